"""Adapters in a file of one's own, `./my_adapter.py:MyModel`, for a try without a package."""

import re
import sys
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from infthor_eval.errors import ModelError, wrap_errors
from infthor_eval.formats.digests import digest

__all__ = ["class_in_file", "class_name", "identity_of_file", "names_a_file"]


def names_a_file(name: str) -> bool:
    """Whether a model's name is of the form FILE.py:CLASS."""
    return re.fullmatch(r".+\.py:\w+", name) is not None


def class_name(name: str) -> str:
    """The class that such a name ends in."""
    return name.rpartition(":")[2]


def class_in_file(name: str) -> Any:
    """Run the file, once for each content that it has, and give its class.

    What lies beside the file is not found by its imports: an adapter of several files is a package.

    Raises:
        ModelError: there is no such file or class, or the file fails when it is imported.
    """
    path = _path(name)
    module = _module(path, _source(path))
    found = getattr(module, class_name(name), None)
    if found is None:
        raise ModelError(f"{path} has no class {class_name(name)}; write FILE.py:CLASS with one that is in the file")
    return found


def identity_of_file(name: str) -> dict[str, Any]:
    """The file's name and its content as JSON values; where it lies does not matter.

    Raises:
        ModelError: it cannot be read.
    """
    path = _path(name)
    return {"file": path.name, "source": digest(_source(path))}


def _path(name: str) -> Path:
    path = Path(name.rpartition(":")[0]).resolve()
    if not path.is_file():
        raise ModelError(f"{path}: there is no such file; write FILE.py:CLASS with the adapter's file")
    return path


def _source(path: Path) -> bytes:
    with wrap_errors(f"{path}: cannot be read", "mend the adapter's file", raise_as=ModelError):
        return path.read_bytes()


@cache
def _module(path: Path, source: bytes) -> ModuleType:
    # Not by Python's own import, which takes a compiled file for the source where both are of one second and one size.
    module = ModuleType(f"infthor_eval_own_{digest(source)}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module  # dataclasses look up their annotations there
    with wrap_errors(f"{path}: fails when it is imported", "mend it", catch=Exception, raise_as=ModelError):
        exec(compile(source, path, "exec"), vars(module))
    return module
