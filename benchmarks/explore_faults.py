"""Check that no fault of a disk, a kill or a clock loses anything, at each call that changes files.

    python benchmarks/explore_faults.py
    python benchmarks/explore_faults.py --kinds questions,replay --faults kill,full --most 10

A run of each kind is cut at each of its calls that create, write, rename, sync or delete in its
output folder; then the same command must give the same bytes as an uncut run. The table goes to
standard output, what was lost to standard error.
"""

import argparse
import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from fault_explorer.control import Control, Fault, NoCompilerError, compile_shim

_FAULTS = {fault.name.lower().replace("_", "-"): fault for fault in Fault}


def main(words: Sequence[str] | None = None) -> int:
    """Explore, and return 1 if anything was lost."""
    options = _arguments(words)
    if "FAULT_CONTROL" not in os.environ:
        return _start_with_shim(words)
    return _explore_all(options)


def _arguments(words: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kinds", help="kinds of runs, with commas; default: all")
    parser.add_argument("--faults", default=",".join(_FAULTS), help="with commas; default: all")
    parser.add_argument("--most", type=int, help="cuts of each fault and kind, at most")
    return parser.parse_args(words)


def _start_with_shim(words: Sequence[str] | None) -> int:
    with tempfile.TemporaryDirectory(prefix="explore-faults-") as folder:
        root = Path(folder).resolve()
        try:
            library = compile_shim(root)
        except NoCompilerError as error:
            print(f"not explored: {error}", file=sys.stderr)
            return 2
        control = root / "control"
        Control(control)
        environment = Control.environment(library, control)
        environment |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        command = [sys.executable, __file__, *(sys.argv[1:] if words is None else words)]
        process = os.spawnve(os.P_WAIT, sys.executable, list(map(str, command)), environment)
        return process


def _explore_all(options: argparse.Namespace) -> int:
    path = Path(os.environ["FAULT_CONTROL"])
    control = Control(path)
    Control.leave_environment()
    from fault_explorer.exploring import explore
    from fault_explorer.forks import Place
    from fault_explorer.kinds import KINDS

    faults = [_FAULTS[name] for name in options.faults.split(",")]
    kinds = [kind for kind in KINDS if options.kinds is None or kind.name in options.kinds.split(",")]
    print("| kind | calls | cut points | survived | told | lost | s |\n|---|---|---|---|---|---|---|")
    lost = 0
    for kind in kinds:
        process = os.fork()
        if not process:
            place = Place(path.parent / kind.name)
            place.inputs.mkdir(parents=True)
            for result in explore(kind, place, control, faults, options.most):
                cut = result.cuts[-1]
                if cut.problem or cut.told:
                    print(kind.name, cut.fault.name, cut.at, cut.call, "LOST " + cut.problem if cut.problem else "told " + cut.told, file=sys.stderr, flush=True)
            n = len(result.cuts)
            survived = n - len(result.lost) - len(result.told)
            print(f"| {kind.name} | {len(result.calls)} | {n} | {survived} | {len(result.told)} | {len(result.lost)} | {result.seconds:.0f} |", flush=True)
            os._exit(bool(result.lost))
        lost += os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
    return int(lost > 0)


if __name__ == "__main__":
    sys.exit(main())
