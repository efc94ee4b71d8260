"""The code of a page: which blocks run in a test, and the reason of each that does not.

`python -m tests.docs.commands` counts them.
"""

import re
import shlex
from collections import Counter
from dataclasses import dataclass

from .blocks import ROOT, blocks_of

WEIGHTS = "downloads weights"
UNITY = "needs Unity, or data of the reader's"
GPU = "needs a GPU"
KEY = "needs a server, and a key"
READERS = "names files or runs of the reader's"
PERSON = "a person answers, or looks at a page"
CLONE = "is for who changes the project, in a clone"
HOURS = "takes many minutes of a processor"
ELSEWHERE = "needs the example package installed; tests/examples does that"
OTHERS = "needs another harness installed; tests/harness runs it"

# Pages whose commands are parsed and not run.
PARSED_PAGES = {
    "CONTRIBUTING.md": CLONE,
    "docs/engines.md": GPU,
    "docs/figures.md": HOURS,
    "docs/howto/inspect-robots.md": OTHERS,
    "docs/howto/lmms-eval.md": READERS,
    "docs/howto/own-scenes.md": HOURS,
    "docs/howto/publish-a-set.md": READERS,
    "docs/howto/trackers.md": "needs an account of a tracker",
    "docs/howto/unity.md": UNITY,
    "docs/howto/vla-eval.md": OTHERS,
    "docs/manipulation.md": HOURS,
    "docs/memories.md": HOURS,
    "docs/nieh.md": HOURS,
    "docs/paper.md": HOURS,
    "docs/people.md": PERSON,
    "docs/plans.md": HOURS,
    "docs/policies.md": KEY,
    "docs/report.md": READERS,
    "docs/submit.md": READERS,
    "docs/moments.md": HOURS,
    "docs/twins.md": HOURS,
    "examples/sums/README.md": ELSEWHERE,
    "examples/thumbnails/README.md": ELSEWHERE,
    "infthor_board/README.md": READERS,
    "recipes/nano/README.md": HOURS,
}
# On the other pages a command that matches is parsed and not run. One that matches nothing any more
# fails a test.
CANNOT_RUN = {
    r"--models? (qwen2\.5-vl|llava-onevision|openvla|deepseek-vl)[ ,]": WEIGHTS,
    r"import-checkpoint PEARLS-Lab/": WEIGHTS,
    r"--model hf-multimodal ": WEIGHTS,
    r"--model (openai|anthropic|gemini) ": KEY,
    r"--rehearse|--count 100": HOURS,
    r"results/MODEL/|MyModel|my_task$|=PATH\b|DATA$": READERS,
    r"import-replies exported|lm-eval run \.\.\.": READERS,
}
OURS = ("infthor-eval", "infthor-board")
PROGRAMS = (
    *(*OURS, "make", "lm-eval", "pip", "python", "hf", "torchrun", "export"),
    *("vla-eval", "inspect-robots"),
)
_RUN_HERE = ("infthor-eval", "lm-eval")


@dataclass(frozen=True)
class Command:
    """A command as a page has it.

    Attributes:
        page: the page.
        text: without its comment.
        words: as a shell would split them, globs as they are; variables of the environment before
            it left out.
    """

    page: str
    text: str
    words: tuple[str, ...]

    @property
    def is_ours(self) -> bool:
        """Whether it is a program of ours, with all its words written out."""
        return self.words[0] in OURS and "..." not in self.words

    @property
    def needs_shell(self) -> bool:
        """Whether its words depend on more than the names of files."""
        return "$(" in self.text or " > " in self.text or not self.is_ours

    @property
    def exit_code(self) -> int:
        """The code that it ends with: `explain` says by 1 that runs differ."""
        return int("explain" in self.words)

    @property
    def reason(self) -> str | None:
        """Why it cannot run here; None where it can."""
        if self.page in PARSED_PAGES:
            return PARSED_PAGES[self.page]
        if self.words[0] not in _RUN_HERE:
            return f"{self.words[0]} changes the environment"
        return next(
            (reason for pattern, reason in CANNOT_RUN.items() if re.search(pattern, self.text)),
            None,
        )


@dataclass(frozen=True)
class Code:
    """A block of a page that a reader runs: commands, or lines of Python."""

    commands: tuple[Command, ...] = ()
    python: str = ""

    @property
    def runs(self) -> bool:
        """Whether at least a part of it runs in a test."""
        return bool(self.python) or any(command.reason is None for command in self.commands)


def code_of(page: str) -> list[Code]:
    """The blocks of a page that a reader runs, in order; those with a file's name are files."""
    found = []
    for block in blocks_of(page):
        if block.language == "python" and not block.title:
            found.append(Code(python=block.text))
        elif block.language in ("", "bash") and (commands := _commands(page, block.text)):
            found.append(Code(commands))
    return found


def all_pages() -> list[str]:
    """The pages for readers: the repository's, the documentation, and beside the packages."""
    patterns = (
        *("*.md", "docs/**/*.md", "infthor_board/*.md"),
        *("examples/**/*.md", "recipes/**/*.md"),
    )
    paths = [path for pattern in patterns for path in ROOT.glob(pattern)]
    return sorted(str(path.relative_to(ROOT)) for path in paths)


def count_commands() -> Counter[str]:
    """How many commands and blocks of Python run, and how many do not, by the reason."""
    counts: Counter[str] = Counter()
    for page in all_pages():
        for code in code_of(page):
            counts.update(command.reason or "run" for command in code.commands)
            counts["run"] += bool(code.python)
    return counts


def _commands(page: str, text: str) -> tuple[Command, ...]:
    lines = text.replace("\\\n", " ").splitlines()
    parts = [part for line in lines for part in line.split(" ; ")]
    commands = tuple(filter(None, (_command(page, part) for part in parts)))
    if commands and text.lstrip().startswith(commands[0].text.split(maxsplit=1)[0]):
        return commands
    return ()


def _command(page: str, line: str) -> Command | None:
    text = re.sub(r"\s+#\s.*$", "", line).strip()
    try:
        words = shlex.split(text)
    except ValueError:
        return None
    while words and re.match(r"[A-Z_]+=", words[0]):
        words = words[1:]
    return Command(page, text, tuple(words)) if words and words[0] in PROGRAMS else None


if __name__ == "__main__":
    for reason, count in count_commands().most_common():
        print(f"{count:4} {reason}")
