"""The tables of settings in docs/own-tasks.md, from the code: `python -m
tests.docs.settings_tables` writes them.

To add or change a setting of task files: a field of the suite's class that `docs/own-tasks.md`
names; then run this.
"""

import importlib
import inspect
import re
import types
import typing
from dataclasses import MISSING, Field, fields
from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs" / "own-tasks.md"
_PLACE = re.compile(r"(<!-- settings: (\S+):(\w+) -->\n)(.*?)(<!-- end -->)", re.DOTALL)
_KINDS = {
    int: "whole number",
    float: "number",
    str: "text",
    bool: "true or false",
    tuple[float, ...]: "list of numbers",
    dict[str, typing.Any]: "mapping",
}


def with_tables(page: str) -> str:
    """The page with a table in each place that names a class of settings."""
    return _PLACE.sub(lambda match: f"{match[1]}{_table(match[2], match[3])}{match[5]}", page)


def _table(module: str, name: str) -> str:
    settings = getattr(importlib.import_module(module), name)
    hints, said = typing.get_type_hints(settings), _attributes(settings)
    lines = ["| setting | is a | default | |", "|---|---|---|---|"]
    for item in fields(settings):
        lines.append(
            f"| `{item.name}` | {_kind(hints[item.name])} | {_shown(_default(item))} | "
            f"{said[item.name]} |"
        )
    return "\n".join(lines) + "\n"


def _default(item: Field[typing.Any]) -> typing.Any:
    return item.default if item.default_factory is MISSING else item.default_factory()


def _kind(hint: typing.Any) -> str:
    taken = typing.get_args(hint) if isinstance(hint, types.UnionType) else (hint,)
    return _KINDS[next(kept for kept in taken if kept is not types.NoneType)]


def _shown(default: object) -> str:
    if default in (None, ""):
        return "-"
    if isinstance(default, bool):
        return f"`{str(default).lower()}`"
    return f"`{list(default)}`" if isinstance(default, tuple) else f"`{default}`"


def _attributes(settings: type) -> dict[str, str]:
    """What the docstring says of each attribute."""
    text = inspect.getdoc(settings).partition("Attributes:\n")[2]
    attributes = re.findall(r"^    (\w+): (.*(?:\n {8}.*)*)", text, re.MULTILINE)
    return {name: " ".join(said.split()).replace("|", "\\|") for name, said in attributes}


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text()))
