"""Adapters and scorers in a user's own file, `./my_adapter.py:MyModel`, which need no package."""

import re
import sys
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from infthor_eval.errors import AdapterError, ModelError, wrap_errors, wrap_user_code
from infthor_eval.storage.deadlines import limit_by
from infthor_eval.storage.digests import digest
from infthor_eval.storage.limits import OWN_CODE_SECONDS


def names_a_file(name: str) -> bool:
    """Return whether a name has the form FILE.py:NAME."""
    return re.fullmatch(r".+\.py:\w+", name) is not None


def name_in_file(name: str) -> str:
    """Return the second part of a name of the form FILE.py:NAME."""
    return name.rpartition(":")[2]


def load_from_file(name: str, kind: str = "class") -> Any:
    """Run the file, once for each version of its content; return what has that name in it.

    The file cannot import its neighbours: code of several files has to be a package.

    Args:
        name: FILE.py:NAME.
        kind: what is behind the name in words, for messages.
    """
    path = _path(name)
    module = _module(path, _source(path))
    target = getattr(module, name_in_file(name), None)
    if target is None:
        raise ModelError(
            f"{path} has no {kind} {name_in_file(name)}; write FILE.py:NAME with a {kind} in it"
        )
    return target


def file_identity(name: str) -> dict[str, Any]:
    """Return the file's name and its content's digest, as JSON values, whatever its folder."""
    path = _path(name)
    return {"file": path.name, "source": digest(_source(path))}


def _path(name: str) -> Path:
    path = Path(name.rpartition(":")[0]).resolve()
    if not path.is_file():
        raise ModelError(
            f"{path}: there is no such file; write FILE.py:NAME with a file of your own"
        )
    return path


def _source(path: Path) -> bytes:
    with wrap_errors(f"{path}: cannot be read", "check its permissions", raise_as=ModelError):
        return path.read_bytes()


@cache
def _module(path: Path, source: bytes) -> ModuleType:
    # Python's own import would run a stale .pyc if the edited file has the same size and
    # modification second.
    module = ModuleType(f"infthor_eval_own_{digest(source)}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module  # dataclasses resolve annotations through it
    problem = f"{path}: fails when it is imported"
    with (
        wrap_user_code(problem, "fix it", AdapterError),
        limit_by(OWN_CODE_SECONDS, problem, AdapterError),
    ):
        exec(compile(source, path, "exec"), vars(module))
    return module
