"""Print the section of a version in CHANGELOG.md, as the notes of its release.

python docs/release_notes.py 0.1.0
"""

import argparse
import re
import sys
from pathlib import Path

CHANGES = Path(__file__).parents[1] / "CHANGELOG.md"


def notes_of(version: str, changes: str) -> str | None:
    """Return the section of a version without its heading; None if there is none."""
    heading = rf"^## {re.escape(version)}(?:,[^\n]*)?\n"
    section = re.search(rf"{heading}(.*?)(?=^## |\Z)", changes, re.DOTALL | re.MULTILINE)
    return None if section is None else section[1].strip()


def main() -> int:
    """Print the notes of the version that is given; exit with 2 if there are none."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("version", help="as in the heading of its section, such as 0.1.0")
    version = parser.parse_args().version
    notes = notes_of(version, CHANGES.read_text(encoding="utf-8"))
    if notes is None:
        print(f"{CHANGES.name}: no section of version {version}", file=sys.stderr)
        return 2
    print(notes)
    return 0


if __name__ == "__main__":
    sys.exit(main())
