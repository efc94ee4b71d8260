"""Pages of the site that lie outside docs/, and links between all pages (a hook of mkdocs).

Every page is written to be read in the repository, so a link leads to where a file lies there; here
it is made one to where the page stands in the site. A link to a file that is no page is left as it
is, and `--strict` names it.
"""

import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File

__all__ = ["on_files", "on_page_markdown"]

_DOCS = "docs/"
_OUTSIDE = {  # where a file lies in the repository: where its page stands in the site
    "CHANGELOG.md": "CHANGELOG.md",
    "CONTRIBUTING.md": "CONTRIBUTING.md",
    "benchmarks/README.md": "benchmarks/README.md",
    "benchmarks/cost.md": "benchmarks/cost.md",
    "benchmarks/engines.md": "benchmarks/engines.md",
    "benchmarks/drawings.md": "benchmarks/drawings.md",
    "benchmarks/generation.md": "benchmarks/generation.md",
    "benchmarks/gpu.md": "benchmarks/gpu.md",
    "benchmarks/gpu_first_run.md": "benchmarks/gpu_first_run.md",
    "benchmarks/gpu_h100.md": "benchmarks/gpu_h100.md",
    "benchmarks/manipulation.md": "benchmarks/manipulation.md",
    "benchmarks/memories.md": "benchmarks/memories.md",
    "benchmarks/families.md": "benchmarks/families.md",
    "benchmarks/faults.md": "benchmarks/faults.md",
    "benchmarks/first_afternoon.md": "benchmarks/first_afternoon.md",
    "benchmarks/plans.md": "benchmarks/plans.md",
    "benchmarks/rehearsal.md": "benchmarks/rehearsal.md",
    "benchmarks/simulator.md": "benchmarks/simulator.md",
    "benchmarks/speed.md": "benchmarks/speed.md",
    "benchmarks/twins.md": "benchmarks/twins.md",
    "benchmarks/twins_agents.md": "benchmarks/twins_agents.md",
    "examples/sums/README.md": "examples/sums/README.md",
    "examples/thumbnails/README.md": "examples/thumbnails/README.md",
    "infthor_board/README.md": "infthor_board/README.md",
    "infthor_sim/ACTIONS.md": "infthor_sim/ACTIONS.md",
    "infthor_sim/README.md": "infthor_sim/README.md",
    "recipes/nano/README.md": "recipes/nano/README.md",
    "results/README.md": "results/README.md",
}
_LINK = re.compile(r"(?<=\]\()(?![a-z]+:|#)([^)#\s]+)")


def on_files(files: Any, config: Any) -> Any:
    """Add the pages that lie outside docs/."""
    root = Path(config.config_file_path).parent
    for source, place in _OUTSIDE.items():
        files.append(File.generated(config, place, abs_src_path=str(root / source)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Turn links between files of the repository into links between pages of the site."""
    place = page.file.src_uri
    source = next(
        (source for source, target in _OUTSIDE.items() if target == place), f"{_DOCS}{place}"
    )
    return _LINK.sub(lambda link: _in_site(link[1], source, place), markdown)


def _in_site(link: str, source: str, place: str) -> str:
    path = posixpath.normpath(posixpath.join(posixpath.dirname(source), link))
    if path in _OUTSIDE:
        target = _OUTSIDE[path]
    elif path.startswith(_DOCS):
        target = path.removeprefix(_DOCS)
    else:
        return link
    return posixpath.relpath(target, posixpath.dirname(place) or ".")
