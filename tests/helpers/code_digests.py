"""A digest of what code does: comments, docstrings, and imports do not count."""

import ast
import hashlib
import inspect
import textwrap
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any


def digest_of_code(*parts: ModuleType | FunctionType | Path) -> str:
    """Return a digest of modules, functions and Python files as code, other files as text."""
    told = [_outline(ast.parse(text)) if is_code else text for text, is_code in map(_read, parts)]
    return hashlib.sha256(repr(told).encode()).hexdigest()[:16]


def _read(part: ModuleType | FunctionType | Path) -> tuple[str, bool]:
    if isinstance(part, Path):
        return part.read_text(encoding="utf-8"), part.suffix == ".py"
    return textwrap.dedent(inspect.getsource(part)), True


def _outline(node: Any) -> Any:
    if isinstance(node, list):
        return [_outline(it) for it in node if not _does_nothing(it)]
    if not isinstance(node, ast.AST):
        return repr(node)
    # Which empty fields there are depends on the version of Python.
    fields = [(name, value) for name, value in ast.iter_fields(node) if value not in (None, [])]
    return [type(node).__name__, *((name, _outline(value)) for name, value in fields)]


def _does_nothing(node: Any) -> bool:
    """Return True for an import, the list of what is exported, and a docstring."""
    if isinstance(node, ast.Assign):
        return any(isinstance(it, ast.Name) and it.id == "__all__" for it in node.targets)
    is_text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    return is_text or isinstance(node, ast.Import | ast.ImportFrom)
