"""Lines of Every Eval Ever's files of samples: one for each sample and metric."""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from infthor_eval.exports.measures import Measure, Scored, counted
from infthor_eval.exports.samples import ACT, describe_result, facts_of, payload_of
from infthor_eval.report.descriptions import StepRow
from infthor_eval.report.sample import Sample
from infthor_eval.run import Run
from infthor_eval.runs import StoredFrames, UnitRecord

SCHEMA_VERSION = "0.3.0"
Row = dict[str, Any]


def result_id(measure: Measure) -> str:
    """Return the id of a metric's result, which joins it with its samples."""
    return f"{measure.task}/{measure.metric}"


def sample_rows(run: Run, measures: Sequence[Measure], shared: Row) -> Iterator[Row]:
    """Yield the lines of a run.

    Args:
        run: the run.
        measures: the metrics of all its tasks.
        shared: what all lines have.
    """
    groups = _records_by_group(run)
    told: set[str] = set()
    for measure in measures:
        of_metric = shared | {
            "evaluation_name": run.header.with_frames(measure.task),
            "evaluation_result_id": result_id(measure),
        }
        for scored in measure.samples:
            if not scored.repetitions:
                members = [Sample(run, it) for it in groups.get((measure.task, scored.name), ())]
                yield of_metric | _group_row(scored, members)
                continue
            for record, score in scored.repetitions:
                name = f"{record.task} {record.key}"
                # The journal's own record of it once: it is as long as all else.
                yield of_metric | _row(Sample(run, record), score, is_first=name not in told)
                told.add(name)
        if measure.is_primary:
            # A line has to have a score; the metric's own leaves these out.
            failed = (it for it in counted(run, measure.task) if it.failure is not None)
            for record in failed:
                yield of_metric | _row(Sample(run, record), 0.0, is_first=True)


def _records_by_group(
    run: Run,
) -> Mapping[tuple[str, str], Sequence[UnitRecord[Any]]]:
    groups: dict[tuple[str, str], list[UnitRecord[Any]]] = {}
    for record in sorted(run.records, key=lambda record: record.key):
        name = " ".join(filter(None, (run.presenter.group(record), record.variant)))
        if run.presenter.group(record) and record.excluded is None:
            groups.setdefault((record.task, name), []).append(record)
    return groups


def _row(sample: Sample, score: float, *, is_first: bool) -> Row:
    record = sample.record
    about = facts_of(sample)
    if is_first:
        about["payload"] = payload_of(sample)
    return {
        "schema_version": SCHEMA_VERSION,
        "sample_id": str(record.key),
        "sample_hash": _hash(sample.question, [sample.target]),
        "interaction_type": "agentic" if sample.is_episode else "single_turn",
        "input": {
            "raw": sample.question,
            "formatted": None if sample.is_episode else sample.request_text(_images),
            "reference": [sample.target] if sample.target else [],
        },
        **(_messages(sample) if sample.is_episode else _output(sample)),
        "evaluation": {
            "score": score,
            "is_correct": score >= 1,
            **(_turns(sample.steps) if sample.is_episode else {}),
        },
        "token_usage": _tokens(sample),
        "performance": {"latency_ms": 1000 * record.seconds} if record.seconds else None,
        "error": record.failure,
        "metadata": about,
    }


def _output(sample: Sample) -> Row:
    replied = sample.record.failure is None
    attribution = {
        "turn_idx": 0,
        "source": "output.raw",
        "extracted_value": sample.reply,
        "extraction_method": "the scorer that the metric names reads the reply",
        "is_terminal": True,
    }
    return {
        "output": {
            "raw": [sample.reply] if replied else [],
            "reasoning_trace": None if sample.thinking is None else [sample.thinking],
        },
        "messages": None,
        "answer_attribution": [attribution] if replied else [],
    }


def _messages(sample: Sample) -> Row:
    messages: list[Row] = [{"role": "user", "content": f"{sample.target}\n{sample.question}"}]
    for number, step in enumerate(sample.steps):
        call = f"{ACT}-{number}"
        messages += [
            {
                "role": "assistant",
                "content": step.reply or step.action,
                "tool_calls": [{"id": call, "name": ACT, "arguments": {"action": step.action}}],
            },
            {"role": "tool", "content": describe_result(step), "tool_call_id": [call]},
        ]
    for number, message in enumerate(messages):
        message["turn_idx"] = number
    return {"output": None, "messages": messages, "answer_attribution": []}


def _turns(steps: Sequence[StepRow]) -> Row:
    return {"num_turns": len(steps) or None, "tool_calls_count": len(steps)}


def _group_row(scored: Scored, members: Sequence[Sample]) -> Row:
    """Return the line of a group, such as both replies to a pair of twins."""
    question = "\n".join(dict.fromkeys(sample.question for sample in members)) or scored.name
    references = [sample.target for sample in members]
    return {
        "schema_version": SCHEMA_VERSION,
        "sample_id": scored.name,
        "sample_hash": _hash(question, references),
        "interaction_type": "single_turn",
        "input": {"raw": question, "reference": references},
        "output": {"raw": [sample.reply for sample in members]},
        "messages": None,
        "answer_attribution": [],
        "evaluation": {"score": scored.score, "is_correct": scored.score >= 1},
        "metadata": {
            "cluster": scored.cluster,
            "members": json.dumps([str(sample.record.key) for sample in members]),
        },
    }


def _images(frames: StoredFrames) -> str:
    return "<image>" * frames.n  # as in lm-eval's files


def _tokens(sample: Sample) -> Row | None:
    tokens = sample.tokens
    if tokens is None:
        return None
    return {
        "input_tokens": tokens.context,
        "output_tokens": tokens.reply,
        "total_tokens": tokens.context + tokens.reply,
        "input_tokens_cache_read": tokens.cached,
    }


def _hash(question: str, references: Sequence[str]) -> str:
    return hashlib.sha256("".join([question, *references]).encode()).hexdigest()
