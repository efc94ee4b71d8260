"""The adapter `human`: a person, on a page of this machine."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

from msgspec import Meta

from infthor_eval.pages.server import listen, require_page_extra
from infthor_eval.settings import Setting

if TYPE_CHECKING:
    from model_adapters.human.model import HumanModel


@dataclass(frozen=True, kw_only=True)
class HumanOptions:
    """Options of the page that a person answers on."""

    reader: Annotated[
        str,
        Meta(pattern=r"^[\w.-]{1,40}$"),
        Setting(
            help="Who answers: a name or a number, which tells people apart in tables and folders.",
            is_a="a name of at most 40 letters, digits, '.', '-' and '_'",
        ),
    ] = "1"
    port: Annotated[
        int, Meta(ge=0, le=65_535), Setting(help="Port of the page; 0 for any that is free.")
    ] = 0
    browser: Annotated[
        bool, Setting(help="Open the page in the browser of this machine, if it has a screen.")
    ] = True


class Human:
    """The adapter `human`."""

    Options: ClassVar[type] = HumanOptions

    @classmethod
    def build(cls, name: str, options: HumanOptions, seed: int) -> "HumanModel":  # noqa: ARG003
        """Build the model and take its port; the page opens with the first question."""
        require_page_extra()
        from model_adapters.human.model import HumanModel

        # A port that is taken must end the run here; later it would fail each question.
        return HumanModel(name, options, listen(options.port))
