"""The first run on a GPU: thirteen steps, the cheapest first, and a page of expected and measured.

    python benchmarks/gpu_first_run.py --out results/gpu
    python benchmarks/gpu_first_run.py --out results/gpu --download     # 16 GB of weights, the set
    python benchmarks/gpu_first_run.py --out results/gpu --list
    python benchmarks/gpu_first_run.py --out /tmp/rehearsal --device cpu --tiny

It takes under an hour. A step that fails, or that needs what is not there, stops no other. The same
command goes on where it stopped: what is done is not done again, what failed or was not run is
tried again. The page is OUT/page.md; each step's folder below OUT has its logs and runs.
"""

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import torch
from first_run.machine import Machine, find_machine
from first_run.page import page
from first_run.results import StepResult, read_result, write_result
from first_run.steps import STEPS, Step
from first_run.work import StepFailed, Work

from infthor_eval.errors import InfthorError, in_one_line
from infthor_eval.storage.files import prepare_folder, write_atomically

_PATIENCE = 2.5  # times what a step takes on an H100, when it is stopped
_LEAST_S = 300  # before which no step is stopped: a CPU is slow, and disks are


def main(words: Sequence[str] | None = None) -> int:
    """Run the steps, write the page, and return 1 if one failed or is not as expected."""
    options = _arguments(words)
    if options.list:
        for number, step in enumerate(STEPS, 1):
            print(f"{number:2d} {step.name} ({step.seconds} s): {step.purpose}")
        return 0
    machine = find_machine(
        device=options.device,
        tiny=options.tiny,
        checkpoint=options.checkpoint,
        data=options.data,
        download=options.download,
        old_libraries=options.old_libraries,
        frames=options.frames,
    )
    try:
        prepare_folder(options.out)
        results = run_steps(machine, options.out, options.minutes * 60, options.steps)
    except InfthorError as error:
        sys.exit(str(error))
    for step, result in zip(STEPS, results, strict=True):
        if result.state == "failed" or result.right is False:
            print(f"{step.name}: {result.state}: {result.text}", file=sys.stderr)
    print(options.out / "page.md")
    return int(any(result.state == "failed" or result.right is False for result in results))


def _arguments(words: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the page and all runs")
    parser.add_argument("--device", choices=("cuda", "cpu"), default="cuda")
    parser.add_argument("--tiny", action="store_true", help="rehearse with tiny models")
    parser.add_argument("--checkpoint", type=Path, help="folder of the real model's weights")
    parser.add_argument("--data", type=Path, help="folder of the published set")
    parser.add_argument(
        "--download", action="store_true", help="download weights and set where they are not there"
    )
    parser.add_argument(
        "--old-libraries",
        metavar="FOLDER:...",
        help="folders of the libraries of the policies' publication (reference_policies.py)",
    )
    parser.add_argument(
        "--frames",
        type=int,
        default=1040,
        help="frames of the long trajectory that speeds are measured on; default 1040, 128K tokens",
    )
    parser.add_argument(
        "--minutes", type=float, default=60, help="no step begins after; default 60"
    )
    parser.add_argument(
        "--steps", type=_numbers, default=None, help="numbers of steps, with commas"
    )
    parser.add_argument("--list", action="store_true", help="print the steps, and end")
    options = parser.parse_args(words)
    if options.device == "cuda" and not torch.cuda.is_available():
        parser.error("torch finds no GPU; rehearse with --device cpu --tiny")
    if options.device == "cpu" and not options.tiny:
        parser.error("--device cpu needs --tiny: the real model takes days on a CPU")
    return options


def _numbers(text: str) -> set[int]:
    known = {str(number) for number in range(1, len(STEPS) + 1)}
    unknown = [number for number in text.split(",") if number not in known]
    if unknown:
        raise argparse.ArgumentTypeError(f"{unknown[0]!r} is not a number from 1 to {len(STEPS)}")
    return {int(number) for number in text.split(",")}


def run_steps(
    machine: Machine,
    out: Path,
    seconds: float,
    chosen: set[int] | None = None,
    steps: Sequence[Step] = STEPS,
) -> list[StepResult]:
    """Do the steps that are not done yet, and write the page after each.

    Args:
        machine: what is there.
        out: an existing folder.
        seconds: no step begins after so many.
        chosen: numbers of the steps to do; None for all.
        steps: all steps, in their order.

    Raises:
        DataError: a result in the folder is damaged.
    """
    end = time.monotonic() + seconds
    folders = [out / f"{number:02d}" for number in range(1, len(steps) + 1)]
    results = [_earlier(folder, machine) for folder in folders]
    for at, (step, folder) in enumerate(zip(steps, folders, strict=True)):
        if results[at].state == "done" or (chosen is not None and at + 1 not in chosen):
            continue
        print(f"{at + 1}/{len(steps)} {step.name}", file=sys.stderr, flush=True)
        figures = {other.name: result.figures for other, result in zip(steps, results, strict=True)}
        results[at] = _run(step, machine, folder, end, figures)
        write_result(folder, results[at])
        with write_atomically(out / "page.md") as unfinished:
            unfinished.write_text(page(machine, steps, results), encoding="utf-8")
    return results


def _earlier(folder: Path, machine: Machine) -> StepResult:
    """Return the result of an earlier call on this machine, or that there is none."""
    result = read_result(folder)
    if result is None or not machine.continues(result.machine):
        return StepResult(state="not run", text="not yet")
    return result


def _run(
    step: Step, machine: Machine, folder: Path, end: float, figures: dict[str, dict]
) -> StepResult:
    missing = step.missing(machine)
    start = time.monotonic()
    if missing is None and start >= end:
        missing = "no time left; run the command again, which goes on here"
    if missing is not None:
        return StepResult(state="not run", text=missing, machine=machine.identity)
    own_end = min(end, start + max(_LEAST_S, _PATIENCE * step.seconds))
    try:
        outcome = step.run(Work(machine, folder, own_end, figures))
    # A step reads what others print and write: whatever is wrong with it, the others are done.
    except Exception as error:  # noqa: BLE001
        text = str(error) if isinstance(error, StepFailed) else in_one_line(error)
        return StepResult(
            state="failed", text=text, seconds=time.monotonic() - start, machine=machine.identity
        )
    return StepResult(
        state="done",
        text=outcome.measured,
        right=outcome.right,
        seconds=time.monotonic() - start,
        figures=dict(outcome.figures),
        machine=machine.identity,
    )


if __name__ == "__main__":
    sys.exit(main())
