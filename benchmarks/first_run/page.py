"""The page of a first run: expected and measured, a row a step."""

from collections.abc import Sequence

from .machine import Machine
from .results import StepResult
from .steps import Step

__all__ = ["page"]

_VERDICTS = {True: "yes", False: "**NO**", None: "see"}
_REHEARSAL = (
    "Tiny models with random weights stand for the real ones, and pieces of the work for the whole:"
    " its speeds and accuracies mean nothing. It shows that each step runs, stops, and reports."
)


def page(machine: Machine, steps: Sequence[Step], results: Sequence[StepResult]) -> str:
    """Return the page in Markdown: of each step its result."""
    kind = "A rehearsal of the first run on a GPU" if machine.tiny else "The first run on a GPU"
    versions = ", ".join(
        f"{name} {machine.identity[name]}" for name in ("infthor-eval", "torch", "transformers")
    )
    where = f"{machine.gpus} x {machine.name}" if machine.gpus else machine.name
    lines = [f"# {kind}", ""]
    lines += [f"By `gpu_first_run.py` ([what it is](gpu.md)) on {where}: {versions}."]
    lines += [_REHEARSAL] if machine.tiny else []
    lines += ["", _totals(results), ""]
    lines += ["| | step, and its question | expected on an H100 | measured | as expected | s |"]
    lines += ["|---|---|---|---|---|---|"]
    for number, (step, result) in enumerate(zip(steps, results, strict=True), 1):
        question = f"**{step.name}**: {step.purpose}"
        cells = [str(number), question, f"{step.expected}; {step.seconds} s", *_found(result)]
        lines.append(f"| {' | '.join(map(_cell, cells))} |")
    return "\n".join([*lines, ""])


def _totals(results: Sequence[StepResult]) -> str:
    states = [result.state for result in results]
    n_wrong = sum(result.right is False for result in results)
    seconds = sum(result.seconds for result in results)
    return (
        f"**{states.count('done')} of {len(results)} steps done in {seconds:.0f} s, {n_wrong} of "
        f"them not as expected; {states.count('failed')} failed, {states.count('not run')} not "
        "run.**"
    )


def _found(result: StepResult) -> list[str]:
    if result.state == "done":
        return [result.text, _VERDICTS[result.right], f"{result.seconds:.0f}"]
    seconds = f"{result.seconds:.0f}" if result.state == "failed" else "-"
    return [f"{result.state}: {result.text}", "-", seconds]


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
