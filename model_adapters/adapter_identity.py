"""What identifies the code of an adapter, or a suite, that came with another package."""

from collections.abc import Iterator
from importlib.metadata import EntryPoint
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from infthor_eval.errors import ModelError
from infthor_eval.formats.digests import digest_of_file, fingerprint

__all__ = ["package_identity"]


def package_identity(point: EntryPoint) -> dict[str, Any]:
    """The package behind an entry point, its version and its source, as JSON values.

    An adapter that is edited without a new version is another one: so the source itself counts, of all modules of its
    top-level package. Nothing is imported.

    Raises:
        ModelError: there is no such module, or its source cannot be read.
    """
    package = point.module.partition(".")[0]
    try:
        source = fingerprint({name: digest_of_file(path) for name, path in _sources(package)})
    except (OSError, ValueError) as error:
        raise ModelError(f"{point.name}: the source of {package} cannot be read ({error})") from error
    return {
        "package": point.dist.name if point.dist else package,
        "version": point.dist.version if point.dist else None,
        "source": source,
    }


def _sources(package: str) -> Iterator[tuple[str, Path]]:
    """All Python files of a top-level package or module, by their place in it."""
    spec = find_spec(package)
    if spec is None:
        raise ModelError(f"there is no module {package}; install the package that has it")
    if spec.submodule_search_locations is None:
        yield f"{package}.py", Path(str(spec.origin))
        return
    for folder in map(Path, spec.submodule_search_locations):
        for path in sorted(folder.rglob("*.py")):
            yield path.relative_to(folder).as_posix(), path
