#!/usr/bin/env python3
"""Density and lengths of the packages, held to limits: `make lint` calls it.

Comprehensions within comprehensions and tuples assigned to tuples are hard to read aloud, and so
are long functions and modules. `__all__` says what a package's face has; elsewhere an underscore
does. Exit code 1 if a limit is passed.
"""

import ast
import subprocess
import sys
from collections import Counter
from pathlib import Path

PACKAGES = ("infthor_board", "infthor_eval", "infthor_sim", "model_adapters", "recipes")
WIDTH = 100
LONGEST_MODULE = 600  # lines
LONGEST_FUNCTION = 80
_COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
_LIMITS = {
    "nested comprehensions in 1,000 lines": 0.5,
    "tuples assigned to tuples in 1,000 lines": 1.5,
    f"lines over {WIDTH} columns": 0,
    f"modules over {LONGEST_MODULE} lines": 0,
    f"functions over {LONGEST_FUNCTION} lines": 0,
    "modules with __all__ that are no face": 0,
}


def main() -> int:
    """Print each figure beside its limit."""
    root = Path(__file__).parents[1]
    listed = subprocess.run(
        ["git", "-C", root, "ls-files", *(f"{name}/*.py" for name in PACKAGES)],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    paths = [root / name for name in listed.split() if (root / name).is_file()]
    figures = dict(zip(_LIMITS, _measure(paths), strict=True))
    for name, limit in _LIMITS.items():
        passed = " (too many)" if figures[name] > limit else ""
        print(f"{name}: {figures[name]:.2g} of {limit:g}{passed}")
    return any(figures[name] > limit for name, limit in _LIMITS.items())


def _measure(paths: list[Path]) -> list[float]:
    n_lines = 0
    found: Counter[str] = Counter()
    for path in paths:
        source = path.read_text(encoding="utf-8")
        lines = source.splitlines()
        n_lines += len(lines)
        found["wide"] += sum(len(line) > WIDTH for line in lines)
        found["long"] += len(lines) > LONGEST_MODULE
        found["all"] += path.name != "__init__.py" and "\n__all__ = " in source
        for node in ast.walk(ast.parse(source)):
            found["nested"] += _is_nested(node)
            found["tuples"] += _assigns_tuple(node)
            found["functions"] += _is_long(node)
    thousands = n_lines / 1000
    densities = [found[name] / thousands for name in ("nested", "tuples")]
    return [*densities, *(found[name] for name in ("wide", "long", "functions", "all"))]


def _is_long(node: ast.AST) -> bool:
    if not isinstance(node, ast.FunctionDef):
        return False
    return (node.end_lineno or node.lineno) - node.lineno >= LONGEST_FUNCTION


def _is_nested(node: ast.AST) -> bool:
    if not isinstance(node, _COMPREHENSIONS):
        return False
    inner = (each for part in ast.iter_child_nodes(node) for each in ast.walk(part))
    return any(isinstance(each, _COMPREHENSIONS) for each in inner)


def _assigns_tuple(node: ast.AST) -> bool:
    return (
        isinstance(node, ast.Assign)
        and isinstance(node.targets[0], ast.Tuple)
        and isinstance(node.value, ast.Tuple)
    )


if __name__ == "__main__":
    sys.exit(main())
