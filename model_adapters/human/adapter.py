"""The adapter `human`: a person, on a page of this machine."""

from typing import TYPE_CHECKING, ClassVar

from infthor_eval.pages.server import require_page_extra
from model_adapters.human.options import HumanOptions

if TYPE_CHECKING:
    from model_adapters.human.model import HumanModel

__all__ = ["Human"]


class Human:
    """The adapter `human`."""

    Options: ClassVar[type] = HumanOptions

    @classmethod
    def build(cls, name: str, options: HumanOptions, seed: int) -> "HumanModel":  # noqa: ARG003
        """Build the model; the page opens with the first question.

        Raises:
            UsageError: the extra `page` is not installed.
        """
        require_page_extra()
        from model_adapters.human.model import HumanModel

        return HumanModel(name, options)
