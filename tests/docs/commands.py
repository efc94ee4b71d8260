"""The commands of a page, and the reasons why some cannot run here."""

import re
import shlex
from dataclasses import dataclass

from .blocks import blocks_of

FLOOR_PLANS = "needs recorded floor plans"
# A command that matches is parsed and not run. Each has a reason; one that matches nothing any more
# fails a test.
CANNOT_RUN = {
    r"--models? (qwen2\.5-vl|llava-onevision|openvla|deepseek-vl)[ ,]": "downloads weights",
    r"import-checkpoint PEARLS-Lab/": "downloads weights",
    r" fetch nieh": "downloads the published set",
    r"--model (openai|anthropic|gemini) ": "needs a server, and a key",
    r"check-parity ": "needs a server",
    r"MyModel|my_task$|=PATH\b": "names files of the reader's",
    r"thumbnails": "needs the example package installed; tests/examples does that",
    r"/RUN\b|-ID\b|RUN\.\.\.": "names a run of the reader's",
    r"DATA\b|FOLDER|FloorPlan": FLOOR_PLANS,
    r"--data (DIR|TRAJECTORIES|trajectories) |--unity|--simulator unity": "needs Unity, or data of "
    "the reader's",
    r"report results/\*/nieh_mini-\*|ls runs$": "shows runs that download weights",
    r"DIR$": "needs data of the reader's",
    r"--ray-address": "needs a cluster",
}
PROGRAMS = ("infthor-eval", "make", "lm-eval", "pip", "python", "hf", "torchrun", "export")


@dataclass(frozen=True)
class Command:
    """A command as a page has it.

    Attributes:
        text: without its comment.
        words: as a shell would split them, globs as they are; variables of the environment before
            it left out.
    """

    text: str
    words: tuple[str, ...]

    @property
    def is_ours(self) -> bool:
        """Whether it is `infthor-eval`, with all its words written out."""
        return self.words[0] == "infthor-eval" and "..." not in self.words

    @property
    def reason(self) -> str | None:
        """Why it cannot run here; None where it can."""
        if not self.is_ours:
            return f"{self.words[0]} is not this package's"
        return next(
            (reason for pattern, reason in CANNOT_RUN.items() if re.search(pattern, self.text)),
            None,
        )


def command_blocks(page: str) -> list[list[Command]]:
    """The commands of a page's blocks that begin with one."""
    texts = [block.text for block in blocks_of(page) if not block.language]
    return [commands for text in texts if (commands := _commands(text))]


def _commands(text: str) -> list[Command]:
    lines = text.replace("\\\n", " ").splitlines()
    commands = [
        command for line in lines for part in line.split(" ; ") if (command := _command(part))
    ]
    return (
        commands
        if commands and text.lstrip().startswith(commands[0].text.split(maxsplit=1)[0])
        else []
    )


def _command(line: str) -> Command | None:
    text = re.sub(r"\s+#\s.*$", "", line).strip()
    try:
        words = shlex.split(text)
    except ValueError:
        return None
    while words and re.match(r"[A-Z_]+=", words[0]):
        words = words[1:]
    return Command(text, tuple(words)) if words and words[0] in PROGRAMS else None
