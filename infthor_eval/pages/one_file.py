"""Pages that are one file: their style, script and policy are in it, and nothing is fetched."""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from jinja2 import Environment, StrictUndefined, Template
from markupsafe import Markup

from infthor_eval.pages.policy import file_policy
from infthor_eval.storage.files import write_output


def read_part(package: str, name: str) -> str:
    """Return the text of a file that lies beside the modules of a package."""
    return resources.files(package).joinpath(name).read_text(encoding="utf-8")


LOOK = read_part(__package__, "look.css")  # light and dark, and plain elements
THEME = read_part(__package__, "theme.js")  # the button and the key between them


def write_page_file(
    path: Path,
    template: str,
    values: Mapping[str, Any],
    *,
    style: Sequence[str],
    script: Sequence[str],
    filters: Mapping[str, Callable[..., Any]] | None = None,
    images: str = "data:",
) -> int:
    """Write a page into a file and return its size in bytes; equal values give equal bytes.

    Values come from data files and models: whatever they hold is shown as text.

    Args:
        path: the file.
        template: Jinja template with the places `css`, `js` and `policy`.
        values: what else the template shows.
        style: texts of its style, in order.
        script: texts of its script, in order.
        filters: the template's own filters.
        images: sources of images.
    """
    css, js = "".join(style), "".join(script)
    text = _compiled(template, tuple((filters or {}).items())).render(
        values,
        css=Markup(css),
        js=Markup(js),
        policy=Markup(file_policy(style=css, script=js, images=images)),
    )
    encoded = text.encode("utf-8", "backslashreplace")
    with write_output(path, "give another --out") as partial:
        partial.write_bytes(encoded)
    return len(encoded)


@cache
def _compiled(template: str, filters: tuple[tuple[str, Callable[..., Any]], ...]) -> Template:
    """Compile a template once: an index has hundreds of pages."""
    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= dict(filters)
    return environment.from_string(template)
