"""A run's samples in words: what was asked, what was replied or done, and all else as text."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.exports.gaps import task_config
from infthor_eval.reasons import count_reasons
from infthor_eval.report.presenter import THOUGHT
from infthor_eval.report.web.samples import Prompt, StepRow
from infthor_eval.run import Run
from infthor_eval.runs import UnitKey, UnitRecord

ACT = "act"  # the tool that an agent's or an arm's steps are calls of
FRAME = "<image>"  # stands for a frame in a text, as in lm-eval's files

Record = UnitRecord[Any]


@dataclass(frozen=True)
class TokenCounts:
    """Tokens of a sample's requests, of those not encoded again, and of its replies."""

    context: int
    cached: int
    reply: int


@dataclass(frozen=True)
class Sample:
    """A record with its words.

    Attributes:
        question: the question, the plan or the instruction.
        target: gold answers or goal.
        reply: the reply, or how the episode ended; empty if there is none.
        thinking: what the model thought before it; None if it did not.
        prompt: the request, without the question at its end; None if the suite keeps none.
        steps: what was done in an episode; empty where there is none.
        is_episode: whether it is an episode, and no reply to a request.
        about: further facts, by name.
    """

    record: Record
    question: str
    target: str
    reply: str
    thinking: str | None
    prompt: Prompt | None
    steps: Sequence[StepRow]
    is_episode: bool
    about: Mapping[str, str]

    @property
    def request(self) -> str | None:
        """The whole request, `FRAME` for each frame; None if it is not known."""
        if self.prompt is None or self.prompt.problem:
            return None
        parts = [part if isinstance(part, str) else FRAME * part.n for part in self.prompt.parts]
        return "".join([*parts, self.question])

    @property
    def tokens(self) -> TokenCounts | None:
        """Tokens of its requests and replies; None if they were not counted."""
        tokens, usage = self.record.tokens, self.record.usage
        if tokens.context is not None and tokens.reply is not None:
            return TokenCounts(tokens.context, tokens.cached or 0, tokens.reply)
        if usage.context or usage.reply:
            return TokenCounts(usage.context, usage.cached, usage.reply)
        return None

    @cached_property
    def payload(self) -> str:
        """Everything that the journal has of it, as JSON."""
        return msgspec.json.encode(self.record.payload).decode()


class SampleReader:
    """Puts a run's records into words."""

    def __init__(self, run: Run, data: Path | None) -> None:
        """Make the requests of the run again; `data` is its set, None for the one it names."""
        self._run = run
        self._prompts: Mapping[UnitKey, Prompt] = run.presenter.prompts(run, data)

    @property
    def problems(self) -> list[str]:
        """Why requests cannot be given, a line for each reason."""
        reasons = (("", prompt.problem) for prompt in self._prompts.values() if prompt.problem)
        return [
            f"{self._run.label}: {n} request(s) left out: {reason}"
            for _, reason, n in count_reasons(reasons)
        ]

    def read(self, record: Record) -> Sample:
        """Return a record with its words."""
        presenter = self._run.presenter
        described = presenter.describe(record)
        details = dict(presenter.details(record))
        thinking = details.pop(THOUGHT, None)
        prompt = self._prompts.get(record.key)
        return Sample(
            record=record,
            question=described.title,
            target=described.target,
            reply=presenter.reply(record),
            thinking=thinking,
            prompt=prompt,
            steps=presenter.steps(record),
            is_episode=presenter.replay is not None,
            about=self._about(record, prompt) | {"kind": described.kind} | details,
        )

    def _about(self, record: Record, prompt: Prompt | None) -> dict[str, str]:
        """Return what tells the sample from others, and which frames it was shown."""
        about = {
            "task": record.task,
            "question_id": record.id,
            "variant": record.variant,
            "repeat": str(record.repeat),
            "cluster": record.cluster,
            "group": self._run.presenter.group(record),
            "context": str(task_config(self._run, record.task).dataset_kwargs.get("context", "")),
        }
        ablation = self._run.header.config.frames
        about["frame_ablation"] = "" if ablation == "shown" else ablation
        if prompt is not None and prompt.shown:
            about["frames"] = ",".join(_stretch(*stretch) for stretch in prompt.shown)
        return {name: value for name, value in about.items() if value}


def describe_result(step: StepRow) -> str:
    """Return what came of a step, in words."""
    reward = "" if step.reward is None else f"reward {step.reward:g}"
    return "; ".join(filter(None, (step.error or "done", reward, step.note)))


def _stretch(first: int, last: int) -> str:
    return str(first) if first == last else f"{first}-{last}"
