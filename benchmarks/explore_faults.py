"""Check that no kill, no full disk and no clock costs a result, at each call that changes a file.

    python benchmarks/explore_faults.py --out faults.jsonl
    python benchmarks/explore_faults.py --kinds questions,replay --faults kill,full --most 10

A run of each kind is cut at each of its calls that create, write, rename, sync or delete in its
output folder; then the same command must give the same bytes as an uncut run. Tables go to standard
output, what was lost to standard error; exit code 1 if there is any. A C compiler is needed.
"""

import argparse
import json
import os
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from fault_explorer.control import Control, Fault, NoCompilerError, compile_shim

_FAULTS = {fault.name.lower().replace("_", "-"): fault for fault in Fault}
_NO_COMPILER = 2
_TELL_S = 60.0  # between two lines on how far it is
# Libraries that start threads would lose them in a fork.
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")


def main(words: Sequence[str] | None = None) -> int:
    """Explore, print the tables, and return 1 if anything was lost."""
    words = sys.argv[1:] if words is None else list(words)
    options = _arguments(words)
    if not Control.is_in_environment():
        return _start_with_shim(words)
    rows = _read(options.out)
    for row in _explore_all(options):
        rows[row["kind"]] = row
        if options.out is not None:
            options.out.write_text("".join(f"{json.dumps(each)}\n" for each in rows.values()))
    _print_tables(list(rows.values()))
    return int(any(row["lost"] for row in rows.values()))


def _arguments(words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kinds", help="kinds of runs, with commas; default: all")
    parser.add_argument("--faults", default=",".join(_FAULTS), help="with commas; default: all")
    parser.add_argument("--most", type=int, help="cuts of each fault and kind, at most")
    parser.add_argument("--out", type=Path, help="file with a row a kind, of earlier calls too")
    return parser.parse_args(words)


def _start_with_shim(words: Sequence[str]) -> int:
    """Start this script again, in a process that loads the shim."""
    with tempfile.TemporaryDirectory(prefix="explore-faults-") as folder:
        root = Path(folder).resolve()
        try:
            library = compile_shim(root)
        except NoCompilerError as error:
            print(f"not explored: {error}", file=sys.stderr)
            return _NO_COMPILER
        control = root / "control"
        Control(control)
        environment = Control.environment(library, control) | _ONE_THREAD
        command = [sys.executable, str(Path(__file__).resolve()), *words]
        return os.spawnve(os.P_WAIT, sys.executable, command, environment)


def _explore_all(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """Yield a row for each kind; each is explored in a fork, which imports what it needs."""
    from fault_explorer.kinds import KINDS

    names = [kind.name for kind in KINDS] if options.kinds is None else options.kinds.split(",")
    faults = [_FAULTS[name] for name in options.faults.split(",")]
    path = Control.leave_environment()
    for kind in [kind for kind in KINDS if kind.name in names]:
        folder = path.parent / kind.name
        (folder / "inputs").mkdir(parents=True)
        row = folder / "row.json"
        process = os.fork()
        if not process:
            code = 1
            try:
                row.write_text(json.dumps(_explore(kind, folder, Control(path), faults, options)))
                code = 0
            except SystemExit as error:
                print(error, file=sys.stderr)
            except Exception:  # noqa: BLE001 - as Python ends with it, which a fork does not reach
                traceback.print_exc()
            finally:
                sys.stderr.flush()
                os._exit(code)
        if os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]):
            raise SystemExit(f"{kind.name}: not explored; see above")
        yield json.loads(row.read_text())


def _explore(
    kind: Any, folder: Path, control: Control, faults: list[Fault], options: argparse.Namespace
) -> dict[str, Any]:
    from fault_explorer.exploring import explore
    from fault_explorer.forks import Place

    told_at = time.monotonic()
    for known in explore(kind, Place(folder), control, faults, options.most):
        if time.monotonic() > told_at + _TELL_S:
            told_at = time.monotonic()
            print(f"{kind.name}: {len(known.cuts)} of {known.n_points}", file=sys.stderr)
        cut = known.cuts[-1]
        if cut.lost or cut.told:
            what = f"LOST: {cut.lost}" if cut.lost else f"told: {cut.told}"
            print(
                f"{kind.name}, {cut.fault.name} at {cut.at} ({cut.call}): {what}", file=sys.stderr
            )
    lost = Counter(cut.fault.name for cut in known.cuts if cut.lost)
    told = Counter(cut.fault.name for cut in known.cuts if cut.told and not cut.lost)
    return {
        "kind": kind.name,
        "calls": len(known.calls),
        "possible": known.n_possible,
        "cuts": Counter(cut.fault.name for cut in known.cuts),
        "told": told,
        "lost": lost,
        "states": known.n_states,
        "minutes": round(known.seconds / 60, 1),
    }


def _read(path: Path | None) -> dict[str, dict[str, Any]]:
    lines = path.read_text().splitlines() if path is not None and path.exists() else []
    return {row["kind"]: row for row in map(json.loads, lines)}


def _print_tables(rows: list[dict[str, Any]]) -> None:
    print("| kind of run | calls | possible | cut | states | survived | told | lost | minutes |")
    print("|---|---|---|---|---|---|---|---|---|")
    for row in rows:
        cuts, told, lost = (sum(row[name].values()) for name in ("cuts", "told", "lost"))
        figures = (
            row["calls"],
            row["possible"],
            cuts,
            row["states"],
            cuts - told - lost,
            told,
            lost,
        )
        print(f"| {row['kind']} | {' | '.join(map(str, figures))} | {row['minutes']} |")
    print("\n| fault | cut points | survived | told | lost |\n|---|---|---|---|---|")
    for name, fault in _FAULTS.items():
        cuts, told, lost = (
            sum(row[column].get(fault.name, 0) for row in rows)
            for column in ("cuts", "told", "lost")
        )
        print(f"| {name} | {cuts} | {cuts - told - lost} | {told} | {lost} |")


if __name__ == "__main__":
    sys.exit(main())
