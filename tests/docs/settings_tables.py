"""The tables of settings in docs/own-tasks.md, from the code: `python -m
tests.docs.settings_tables` writes them.
"""

import importlib
import re
from pathlib import Path

from infthor_eval.settings import settings_of

PAGE = Path(__file__).parents[2] / "docs" / "own-tasks.md"
_PLACE = re.compile(r"(<!-- settings: (\S+):(\w+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)


def with_tables(page: str) -> str:
    """The page with a table in each place that names a class of settings."""
    return _PLACE.sub(lambda match: f"{match[1]}{_table(match[2], match[3])}{match[5]}", page)


def _table(module: str, name: str) -> str:
    lines = ["| setting | is a | default | |", "|---|---|---|---|"]
    settings = getattr(importlib.import_module(module), name)
    for setting, declared in settings_of(settings).items():
        default = declared.setting.stands_for if declared.default is None else declared.default
        said = declared.setting.help.replace("|", "\\|")
        lines.append(f"| `{setting}` | {declared.is_a} | {_shown(default)} | {said} |")
    return "\n".join(lines) + "\n"


def _shown(default: object) -> str:
    if default in (None, ""):
        return "-"
    if isinstance(default, bool):
        return f"`{str(default).lower()}`"
    return f"`{list(default)}`" if isinstance(default, tuple) else f"`{default}`"


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text()))
