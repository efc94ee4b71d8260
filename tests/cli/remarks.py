"""What a command writes on standard error, on a fast machine and on a slow one alike."""

import re

_PROGRESS = re.compile(r".*: [\d,]+ of [\d,]+ \(\d+ %\)(, .* left, .*)?")


def remarks(err: str) -> list[str]:
    """Its lines without those on progress, which come where a command takes more than ten
    seconds."""
    return [line for line in err.splitlines() if line.strip() and not _PROGRESS.fullmatch(line)]
