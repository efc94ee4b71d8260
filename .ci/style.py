#!/usr/bin/env python3
"""Density and scatter of the packages, held to limits: `make lint` calls it.

Comprehensions within comprehensions and tuples assigned to tuples are hard to read aloud; a folder
of many files, or of tiny ones, is hard to find one's way in. Exit code 1 if a limit is passed.
"""

import ast
import subprocess
import sys
from collections import Counter
from pathlib import Path

PACKAGES = ("infthor_board", "infthor_eval", "infthor_sim", "model_adapters", "recipes")
WIDTH = 100
TINY = 40  # lines; a shorter module is a concept of its own, or belongs to the one that uses it
_COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
_UNCOUNTED = {"__init__.py", "__main__.py"}
_LIMITS = {
    "nested comprehensions in 1,000 lines": 0.5,
    "tuples assigned to tuples in 1,000 lines": 1.5,
    f"lines over {WIDTH} columns": 0,
    f"files under {TINY} lines": 30,
    "folders over 25 files": 0,
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


def _measure(paths: list[Path]) -> tuple[float, float, int, int, int]:
    n_lines = n_nested = n_tuples = n_long = n_tiny = 0
    folders: Counter[Path] = Counter()
    for path in paths:
        source = path.read_text(encoding="utf-8")
        lines = source.splitlines()
        n_lines += len(lines)
        n_long += sum(len(line) > WIDTH for line in lines)
        n_tiny += len(lines) < TINY and path.name not in _UNCOUNTED
        folders[path.parent] += path.name != "__init__.py"
        for node in ast.walk(ast.parse(source)):
            n_nested += _is_nested(node)
            n_tuples += _assigns_tuple(node)
    thousands = n_lines / 1000
    crowded = sum(n > 25 for n in folders.values())
    return n_nested / thousands, n_tuples / thousands, n_long, n_tiny, crowded


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
