"""Adapters in a user's own file, `./my_adapter.py:MyModel`, which need no package."""

import re
import sys
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from infthor_eval.errors import ModelError, wrap_errors
from infthor_eval.formats.digests import digest

__all__ = ["class_name", "file_identity", "load_class", "names_a_file"]


def names_a_file(name: str) -> bool:
    """Return whether a model's name has the form FILE.py:CLASS."""
    return re.fullmatch(r".+\.py:\w+", name) is not None


def class_name(name: str) -> str:
    """Return the class in a name of the form FILE.py:CLASS."""
    return name.rpartition(":")[2]


def load_class(name: str) -> Any:
    """Run the file, once for each version of its content, and return the class.

    The file cannot import its neighbours: an adapter of several files has to be a package.

    Raises:
        ModelError: the file or the class does not exist, or the file fails when it is imported.
    """
    path = _path(name)
    module = _module(path, _source(path))
    adapter = getattr(module, class_name(name), None)
    if adapter is None:
        raise ModelError(f"{path} has no class {class_name(name)}; write FILE.py:CLASS with a class in it")
    return adapter


def file_identity(name: str) -> dict[str, Any]:
    """Return the file's name and a digest of its content, as JSON values; its folder does not matter.

    Raises:
        ModelError: the file cannot be read.
    """
    path = _path(name)
    return {"file": path.name, "source": digest(_source(path))}


def _path(name: str) -> Path:
    path = Path(name.rpartition(":")[0]).resolve()
    if not path.is_file():
        raise ModelError(f"{path}: there is no such file; write FILE.py:CLASS with the file of the adapter")
    return path


def _source(path: Path) -> bytes:
    with wrap_errors(f"{path}: cannot be read", "check its permissions", raise_as=ModelError):
        return path.read_bytes()


@cache
def _module(path: Path, source: bytes) -> ModuleType:
    # Python's own import would run a stale .pyc if the edited file has the same size and modification second.
    module = ModuleType(f"infthor_eval_own_{digest(source)}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module  # dataclasses resolve annotations through it
    with wrap_errors(f"{path}: fails when it is imported", "fix it", catch=Exception, raise_as=ModelError):
        exec(compile(source, path, "exec"), vars(module))
    return module
