"""What the exports of samples have alike, beside the `Sample`s themselves."""

import msgspec

from infthor_eval.exports.gaps import task_config
from infthor_eval.reasons import count_reasons
from infthor_eval.report.descriptions import THOUGHT, StepRow
from infthor_eval.report.sample import Sample
from infthor_eval.run import Run

ACT = "act"  # the tool that an agent's or an arm's steps are calls of


def facts_of(sample: Sample) -> dict[str, str]:
    """Return what tells a sample from others, which frames it shows, and its details."""
    record = sample.record
    run = sample.run
    ablation = run.header.config.frames
    shown = sample.request.shown if sample.request else ()
    facts = {
        "task": record.task,
        "question_id": record.id,
        "variant": record.variant,
        "repeat": str(record.repeat),
        "cluster": record.cluster,
        "group": run.presenter.group(record),
        "context": str(task_config(run, record.task).dataset_kwargs.get("context", "")),
        "frame_ablation": "" if ablation == "shown" else ablation,
        "frames": ",".join(
            str(first) if first == last else f"{first}-{last}" for first, last in shown
        ),
    }
    told = {name: value for name, value in facts.items() if value}
    details = {name: value for name, value in sample.details.items() if name != THOUGHT}
    return told | {"kind": sample.description.kind} | details


def payload_of(sample: Sample) -> str:
    """Return everything that the journal has of a sample, as JSON."""
    return msgspec.json.encode(sample.record.payload).decode()


def describe_result(step: StepRow) -> str:
    """Return what came of a step, in words."""
    reward = "" if step.reward is None else f"reward {step.reward:g}"
    return "; ".join(filter(None, (step.error or "done", reward, step.note)))


def unknown_requests(run: Run) -> list[str]:
    """Return why requests cannot be given, a line for each reason."""
    problems = [Sample(run, record).request_problem for record in run.records]
    reasons = count_reasons(("", problem) for problem in problems if problem)
    return [f"{run.label}: {n} request(s) left out: {reason}" for _, reason, n in reasons]
