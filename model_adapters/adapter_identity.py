"""Identity of an adapter's or suite's code that comes with another package."""

from collections.abc import Iterator
from importlib.metadata import EntryPoint
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from infthor_eval.errors import ModelError
from infthor_eval.storage.digests import digest_of_file, fingerprint


def package_identity(point: EntryPoint) -> dict[str, Any]:
    """Return an entry point's package, version and digest of its source, as JSON values.

    The digest covers all modules of the top-level package, because an adapter may be edited without
    a new version. Nothing is imported.
    """
    package = point.module.partition(".")[0]
    try:
        source = fingerprint({name: digest_of_file(path) for name, path in _source_files(package)})
    except (OSError, ValueError) as error:
        raise ModelError(
            f"{point.name}: the source of {package} cannot be read ({error})"
        ) from error
    return {
        "package": point.dist.name if point.dist else package,
        "version": point.dist.version if point.dist else None,
        "source": source,
    }


def _source_files(package: str) -> Iterator[tuple[str, Path]]:
    """Yield all Python files of a top-level package or module, with their paths inside it."""
    spec = find_spec(package)
    if spec is None:
        raise ModelError(f"there is no module {package}; install the package that has it")
    if spec.submodule_search_locations is None:
        yield f"{package}.py", Path(str(spec.origin))
        return
    for folder in map(Path, spec.submodule_search_locations):
        for path in sorted(folder.rglob("*.py")):
            yield path.relative_to(folder).as_posix(), path
