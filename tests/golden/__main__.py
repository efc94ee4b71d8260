"""`python -m tests.golden make FOLDER [CASE...]` and `python -m tests.golden compare OLD NEW`."""

import sys
import tempfile
from pathlib import Path

from .comparison import compare, print_differences, read_named
from .normal import normalise, read_golden, write_golden
from .runs import CASES, ROOT, run_cases

_USAGE = f"{__doc__}\nCases: {', '.join(CASES)}"


def main(words: list[str]) -> int:
    """Do what the words say; returns the exit code."""
    match words:
        case ["make", target, *cases] if set(cases) <= set(CASES):
            with tempfile.TemporaryDirectory(prefix="golden-") as folder:
                run_cases(Path(folder), cases)
                write_golden(normalise(Path(folder), ROOT), Path(target))
            return 0
        case ["compare", old, new]:
            differences = compare(read_golden(Path(old)), read_golden(Path(new)))
            return print_differences(differences, read_named(Path(__file__).with_name("named.txt")))
    print(_USAGE, file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
