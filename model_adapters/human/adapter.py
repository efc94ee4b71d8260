"""The adapter `human`: a person, on a page of this machine."""

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from infthor_eval.errors import UsageError
from infthor_eval.pages.server import listen, require_page_extra

if TYPE_CHECKING:
    from model_adapters.human.model import HumanModel

_READER = re.compile(r"[\w.-]{1,40}")


@dataclass(frozen=True, kw_only=True)
class HumanOptions:
    """Options of the page that a person answers on.

    Attributes:
        reader: who answers: a name or a number, which tells people apart in tables and folders.
        port: port of the page; 0 for any that is free.
        browser: open the page in the browser of this machine, if it has a screen.
    """

    reader: str = "1"
    port: int = 0
    browser: bool = True

    def __post_init__(self) -> None:
        """Check all values; raise `UsageError` for one that is out of its range."""
        if not _READER.fullmatch(str(self.reader)):
            raise UsageError(
                f"human: reader is {self.reader!r:.60}; write a name of at most 40 letters, "
                "digits, '.', '-' and '_'"
            )
        if not 0 <= self.port <= 65_535:
            raise UsageError(f"human: port must be between 0 and 65535, not {self.port}")


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
