"""Blocks of code in the site: those with columns (tables, drawings) fit, others are wrapped (a hook
of mkdocs).

`site/site.css` makes the letters of a block with columns as small as its longest line needs.
"""

import html
import re
from typing import Any

__all__ = ["on_page_content"]

_BLOCK = re.compile(r"<pre[^>]*>(?:<span></span>)?<code>(.*?)</code></pre>", re.DOTALL)
_TAG = re.compile(r"<[^>]*>")
_COLUMNS = re.compile(r"\S {3,}\S|[─│┌└▶▼]")  # within a line


def on_page_content(page_html: str, **_: Any) -> str:
    """Mark blocks that have columns, with the letters of their longest line."""
    return _BLOCK.sub(_mark, page_html)


def _mark(block: re.Match[str]) -> str:
    lines = html.unescape(_TAG.sub("", block[1])).splitlines()
    if sum(_COLUMNS.search(line) is not None for line in lines) < 2:
        return block[0]
    letters = max(map(len, lines))
    return block[0].replace("<code>", f'<code class="columns" style="--letters: {letters}">', 1)
