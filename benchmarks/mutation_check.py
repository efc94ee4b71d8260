"""Whether the tests of core modules notice small faults: mutants of each module, and those that
survive.

    python benchmarks/mutation_check.py [TREE] [--per-module 21] [--seed 0] [--only NAME,...]
    [--processes 2]
        [--moved NEW=OLD] [--shared FOLDER]

A mutant is the module with one small change: another comparison or operator, a constant off by one,
a condition negated, a statement removed, None returned. A seeded sample is tried in copies of TREE
against the module's own tests. A mutant survives if these tests pass: either it means the same as
the original, or an assertion is missing.

The sample depends on what a statement looks like without its names, so it stays the same when
things are renamed or moved. For an earlier version of the tree, --moved gives the part of a path
that was different then.
"""

import argparse
import ast
import contextlib
import copy
import hashlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue
from typing import Any, NamedTuple

# Name: module, and the tests that should kill its mutants.
_MODULES = {
    "scoring": ("infthor_eval/nieh/scoring.py", "tests/nieh/test_scoring.py"),
    "rewards": (
        "infthor_eval/plans/rewards.py",
        "tests/plans/test_rewards.py tests/plans/test_rewards_of_ways.py",
    ),
    "statistics": ("infthor_eval/statistics.py", "tests/test_statistics.py"),
    "haystack": ("infthor_eval/nieh/contexts/haystack.py", "tests/nieh/contexts/test_haystack.py"),
    "journal": (
        "infthor_eval/runs/journals/journal.py",
        "tests/runs/journals/test_journal.py tests/runs/work/test_driver.py",
    ),
    "driver": (
        "infthor_eval/runs/work/driver.py",
        "tests/runs/work/test_driver.py tests/runs/work/test_refusals.py "
        "tests/runs/work/test_executor.py tests/runs/test_results.py",
    ),
    "requests": (
        "infthor_eval/runs/journals/requests.py",
        "tests/runs/journals/test_requests.py tests/nieh/rescoring/test_rebuilt_requests.py",
    ),
    "run": (
        "infthor_eval/run.py",
        "tests/test_run.py tests/test_run_names.py tests/report/test_three_states.py "
        "tests/report/test_plain.py tests/test_data_frames.py tests/cli/commands/test_show.py",
    ),
    "settings": ("infthor_eval/settings.py", "tests/test_settings.py tests/nieh/test_suite.py"),
    "facets": ("infthor_eval/facets.py", "tests/nieh/results tests/report/suites"),
    "pairs": (
        "infthor_eval/pairs.py",
        "tests/nieh/results/test_pair_summary.py tests/plans/twins/test_results.py",
    ),
    "asking": (
        "infthor_eval/questions/asking.py",
        "tests/questions tests/nieh/asking",
    ),
    "sample": (
        "infthor_eval/report/sample.py",
        "tests/report/test_sample.py tests/exports tests/cli/commands/test_show.py",
    ),
    "charts": ("infthor_eval/report/charts.py", "tests/report/test_charts.py"),
}
# Hypothesis' profile "ci" draws the same examples each time, remembers none and sets no deadlines.
_PYTEST = ("-x", "-q", "-p", "no:cacheprovider", "-m", "not slow", "--hypothesis-profile=ci")
_NO_VERDICT = (3, 4, 5)  # exit codes of pytest: internal error, wrong usage, nothing collected
_MIN_TIMEOUT_S = 120.0

_COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.Gt), ast.LtE: (ast.Lt, ast.Gt), ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,), ast.NotEq: (ast.Eq,), ast.In: (ast.NotIn,), ast.NotIn: (ast.In,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
}  # fmt: skip
_OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult, ast.Pow: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip
_FUNCTIONS = {"min": "max", "max": "min", "any": "all", "all": "any"}
_NOT_RUN = (
    "annotation",
    "returns",
    "decorator_list",
    "type_params",
)  # parts of statements that stay as they are


class Mutant(NamedTuple):
    """A module's source with one small change: its line, the old and the new text, and the whole
    source."""

    line: int
    change: str
    source: str


def main() -> None:
    """Try the mutants and print the table."""
    chosen = _arguments()
    print(f"{'module':12} {'mutants':>7} {'killed':>7}  survivors")
    with tempfile.TemporaryDirectory() as scratch:
        copies: SimpleQueue[Path] = SimpleQueue()
        for number in range(chosen.processes):
            copies.put(_copied(chosen.tree, chosen.shared, Path(scratch) / str(number)))
        for name in chosen.only.split(","):
            module, tests = (path.replace(*chosen.moved) for path in _MODULES[name])
            mutants = sample(
                (chosen.tree / module).read_text(encoding="utf-8"), chosen.per_module, chosen.seed
            )
            killed = _try_all(copies, module, tests.split(), mutants, chosen.processes)
            alive = [
                mutant for mutant, is_killed in zip(mutants, killed, strict=True) if not is_killed
            ]
            lines = (f"\n    {module}:{mutant.line}: {mutant.change}" for mutant in alive)
            print(
                f"{name:12} {len(mutants):7} {sum(killed):7} {len(alive):10}{''.join(lines)}",
                flush=True,
            )


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "tree", type=Path, nargs="?", default=Path(__file__).parents[1], help="a checkout"
    )
    parser.add_argument("--per-module", type=int, default=21, help="mutants of each module")
    parser.add_argument("--seed", type=int, default=0, help="of the sample")
    parser.add_argument("--only", default=",".join(_MODULES), help="names of modules, with commas")
    parser.add_argument("--processes", type=int, choices=(1, 2), default=2)
    parser.add_argument("--moved", default="=", metavar="NEW=OLD", help="part of a path in TREE")
    parser.add_argument(
        "--shared", type=Path, help="folder with recorded data; else `shared` beside TREE"
    )
    chosen = parser.parse_args()
    chosen.tree, chosen.moved = chosen.tree.resolve(), chosen.moved.split("=")
    chosen.shared = (chosen.shared or chosen.tree.parent / "shared").resolve()
    return chosen


# -- mutants


def sample(source: str, count: int, seed: int) -> list[Mutant]:
    """Draw at most `count` mutants of a module's source, in the order of its lines; another seed
    draws others."""
    tree = ast.parse(source)
    ranked: list[tuple[str, Any, Any]] = []
    seen: dict[str, int] = {}
    for statement, node in _sites(tree):
        for new in (*_changed_expressions(node), *_changed_flow(node)):
            looks = f"{seed} {_nameless(statement)} {_nameless(node)} {_nameless(new)}"
            seen[looks] = seen.get(looks, 0) + 1
            ranked.append(
                (hashlib.sha256(f"{looks} {seen[looks]}".encode()).hexdigest(), node, new)
            )
    drawn = sorted(ranked, key=lambda item: item[0])[:count]
    return sorted(
        (_mutant(tree, node, new) for _, node, new in drawn),
        key=lambda found: (found.line, found.change),
    )


def _mutant(tree: ast.AST, old: Any, new: Any) -> Mutant:
    change = " -> ".join(ast.unparse(node).splitlines()[0] for node in (old, new))
    _replace(tree, old, new)
    source = ast.unparse(tree)
    _replace(tree, new, old)
    return Mutant(old.lineno, change, source)


def _replace(tree: ast.AST, old: ast.AST, new: ast.AST) -> None:
    for parent in list(ast.walk(tree)):
        for name, value in ast.iter_fields(parent):
            if value is old:
                setattr(parent, name, new)
            elif isinstance(value, list):
                value[:] = [new if item is old else item for item in value]


def _sites(tree: ast.AST) -> Iterator[tuple[ast.stmt, ast.AST]]:
    """What can be changed, each with its innermost statement."""
    for parent in ast.walk(tree):
        for statement in ast.iter_child_nodes(parent):
            if isinstance(statement, ast.stmt) and not isinstance(
                statement, ast.Import | ast.ImportFrom
            ):
                yield statement, statement
                yield from ((statement, node) for node in _expressions(statement))


def _expressions(node: ast.AST) -> Iterator[ast.AST]:
    for name, value in ast.iter_fields(node):
        for child in value if isinstance(value, list) else [value]:
            if (
                isinstance(child, ast.AST)
                and not isinstance(child, ast.stmt | ast.JoinedStr)
                and name not in _NOT_RUN
            ):
                yield child
                yield from _expressions(child)


def _nameless(value: Any) -> str:
    """What a statement or expression looks like without names and texts, and without the statements
    within."""
    if isinstance(value, ast.AST):
        fields = ", ".join(_nameless(item) for _, item in ast.iter_fields(value))
        return f"{type(value).__name__}({fields})"
    if isinstance(value, list):
        return str(
            [
                _nameless(item)
                for item in value
                if not isinstance(item, ast.stmt | ast.excepthandler)
            ]
        )
    return "" if isinstance(value, str) else repr(value)


def _changed_expressions(node: ast.AST) -> Iterator[ast.AST]:
    """What an expression is replaced with, one at a time."""
    match node:
        case ast.Compare(left, [operator, *rest], comparators):
            yield from (
                ast.Compare(left, [other(), *rest], comparators)
                for other in _COMPARISONS[type(operator)]
            )
        case ast.BoolOp(operator, operands):
            yield ast.BoolOp(ast.And() if isinstance(operator, ast.Or) else ast.Or(), operands)
        case ast.BinOp(left, operator, right) if type(operator) in _OPERATORS:
            yield ast.BinOp(left, _OPERATORS[type(operator)](), right)
        case ast.UnaryOp(ast.Not() | ast.USub(), operand):
            yield operand
        case ast.Constant(bool(value)):
            yield ast.Constant(not value)
        case ast.Constant(int() | float() as value):
            yield ast.Constant(value + 1)
        case ast.Call(ast.Name(name), arguments, keywords) if name in _FUNCTIONS:
            yield ast.Call(ast.Name(_FUNCTIONS[name]), arguments, keywords)


def _changed_flow(node: ast.AST) -> Iterator[ast.AST]:
    match node:
        case ast.If() | ast.IfExp() if not isinstance(node.test, ast.Compare):
            negated = copy.copy(node)
            negated.test = ast.UnaryOp(ast.Not(), node.test)
            yield negated
        case ast.Return(value) if value is not None and not isinstance(value, ast.Constant):
            yield ast.Return(ast.Constant(None))
        case ast.Raise() | ast.Expr(ast.Call()):
            yield ast.Pass()
        case ast.Continue():
            yield ast.Break()


# -- tests


def _copied(tree: Path, shared: Path, scratch: Path) -> Path:
    """Copy a checkout, with what numba has compiled; the recorded data are linked beside the
    copy."""
    shutil.copytree(
        tree, scratch / "tree", ignore=shutil.ignore_patterns(".git", ".venv", "build", ".*_cache")
    )
    (scratch / "shared").symlink_to(shared)
    return scratch / "tree"


def _try_all(
    copies: "SimpleQueue[Path]",
    module: str,
    tests: Sequence[str],
    mutants: Sequence[Mutant],
    processes: int,
) -> list[bool]:
    """Whether the tests kill each mutant."""

    def passes(source: str | None, timeout_s: float) -> bool:
        tree = copies.get()
        original = (tree / module).read_text(encoding="utf-8")
        try:
            return _passes(tree, module, original if source is None else source, tests, timeout_s)
        finally:
            (tree / module).write_text(original, encoding="utf-8")
            copies.put(tree)

    began = time.monotonic()
    if not passes(None, timeout_s=600.0):
        raise SystemExit(f"{' '.join(tests)} fail without a mutant; fix that first")
    timeout_s = max(_MIN_TIMEOUT_S, 5 * (time.monotonic() - began))
    with ThreadPoolExecutor(processes) as pool:
        return [
            not survived
            for survived in pool.map(lambda mutant: passes(mutant.source, timeout_s), mutants)
        ]


def _passes(tree: Path, module: str, source: str, tests: Sequence[str], timeout_s: float) -> bool:
    """Whether the tests pass with this source as the module; if they take too long they do not."""
    (tree / module).write_text(source, encoding="utf-8")
    command = ["nice", "-n", "10", sys.executable, "-m", "pytest", *_PYTEST, *tests]
    quiet: Any = {
        "stdout": subprocess.DEVNULL,
        "stderr": subprocess.DEVNULL,
        "start_new_session": True,
    }
    # No bytecode is written, as Python would take that of the mutant before: it tells sources apart
    # by second and size.
    environment = {
        **os.environ,
        "PYTHONPATH": str(tree),
        "PYTHONDONTWRITEBYTECODE": "1",
        "OMP_NUM_THREADS": "1",
    }
    process = subprocess.Popen(command, cwd=tree, env=environment, **quiet)
    try:
        code = process.wait(timeout_s)
    except subprocess.TimeoutExpired:
        return False
    finally:  # with all that the tests have started
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    if code < 0 or code in _NO_VERDICT:  # killed from outside, which says nothing of the mutant
        raise SystemExit(f"{' '.join(command)}: ended with {code}")
    return code == 0


if __name__ == "__main__":
    main()
