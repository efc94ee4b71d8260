"""The samples of a task: each question in every variant of its context, and the skipped ones."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.packed.hub import set_folder
from infthor_eval.formats.question import Question, SkippedQuestion
from infthor_eval.formats.undrawn import drawn_folder, is_drawn, is_undrawn
from infthor_eval.nieh.contexts import (
    DEFAULT_CONTEXT,
    Context,
    ContextPart,
    ContextSettings,
    QuestionVariant,
    check_prompt,
    context_named,
)
from infthor_eval.nieh.frame_ablations import FrameAblation
from infthor_eval.nieh.options import NO_CLUE, NONE, SHOWN
from infthor_eval.nieh.prompts import PUBLISHED_MAIN
from infthor_eval.nieh.published.hub_data import default_folder
from infthor_eval.runs import StoredRequest
from infthor_eval.runs.limiting import spread
from infthor_eval.settings import read
from infthor_eval.storage.folders import packaged_folder
from infthor_eval.storage.once import once_a_command

_WORD = re.compile(r"[A-Za-z]{3,}")


@dataclass(frozen=True)
class TaskSamples:
    """The samples of one task in the order of its set.

    Attributes:
        skipped: questions that cannot be asked, with the reason.
        sources: whatever the frames depend on besides the set and the settings (`Context.sources`).
        prompt: the words of the question (`infthor_eval.nieh.prompts`).
    """

    data: NiehSet
    context_name: str
    context: Context
    samples: Sequence[QuestionVariant]
    skipped: Sequence[SkippedQuestion]
    sources: Mapping[str, Any]
    frame_ablation: FrameAblation = field(default_factory=FrameAblation)
    prompt: str = PUBLISHED_MAIN

    @property
    def shows_films(self) -> bool:
        """True if the samples show films, which a model is given as a video or as images."""
        return any(sample.fps is not None for sample in self.samples)

    @cached_property
    def words(self) -> tuple[str, ...]:
        """All words of answers and questions, sorted: a person's typing is completed from them."""
        questions = [sample.question for sample in self.samples]
        answers = {
            answer
            for question in questions
            for answer in question.answers
            if isinstance(answer, str)
        }
        question_words = {
            word.lower() for question in questions for word in _WORD.findall(question.text)
        }
        return tuple(sorted(answers | (question_words - {answer.lower() for answer in answers})))

    def all_frames(self, sample: QuestionVariant) -> list[FrameRef]:
        """Return all frames of the trajectory as a memory observes them: ablated, in their order.

        Those that one question alone hides are not (`hidden`).
        """
        frames = self.data.frames_until(sample.question)
        # The shown ones are shuffled or left out, once they are recalled.
        if self.frame_ablation.frames in ("shuffled", NO_CLUE, NONE):
            return list(frames)
        ablated = self.frame_ablation.apply(frames, self.data, self.context, sample)
        return [part for part in ablated if isinstance(part, FrameRef)]

    def hidden(self, sample: QuestionVariant) -> frozenset[int]:
        """See `FrameAblation.hidden`."""
        return self.frame_ablation.hidden(self.data, sample.question)

    def positions(self, sample: QuestionVariant) -> list[int]:
        """See `FrameAblation.positions`."""
        return self.frame_ablation.positions(self.data, self.context, sample)

    def true_positions(self, sample: QuestionVariant) -> list[int]:
        """See `FrameAblation.true_positions`."""
        return self.frame_ablation.true_positions(self.data, self.context, sample)

    def request(self, sample: QuestionVariant) -> tuple[list[ContextPart], str]:
        """Return the request of a sample: the context, and the text with the question after it."""
        has_frames = self.frame_ablation.frames != NONE
        parts, text = self.context.request(self.data, sample, self.prompt, has_frames=has_frames)
        return self.frame_ablation.apply(parts, self.data, self.context, sample), text

    def stored_request(
        self, sample: QuestionVariant, context: Sequence[ContextPart], text: str
    ) -> StoredRequest:
        """Return the request of a sample (`request`) as a journal has it."""
        traj_id = sample.question.traj_id
        ablation = self.frame_ablation.frames
        return StoredRequest.of(
            context,
            text,
            sample.question.text,
            lambda frames: self.data.find_places(traj_id, frames),
            "frames" if ablation == SHOWN else f"frames ({ablation})",
            self.positions(sample),
        )


@once_a_command
def open_set(root: str, trajectories: str | None = None) -> NiehSet:
    """Open a folder's set, once for all runs of a command."""
    return NiehSet(set_folder(root), Path(trajectories) if trajectories else None)


def find_set(
    data: str | None = None,
    bundled: str | None = None,
    trajectories: str | None = None,
    **_: object,
) -> NiehSet:
    """Return the set of a task.

    Args:
        data: folder of an NIEH set, or hf://OWNER/NAME; None for the published set where
            `infthor-eval fetch nieh` put it.
        bundled: name of a set that comes with the package, which goes before `data`.
        trajectories: folder of the set's trajectories; None if they are in the set.
    """
    if bundled:
        return open_set(str(_bundled_folder(bundled)), trajectories)
    if data is None and not default_folder().is_dir():
        raise UsageError(
            "no NIEH set to ask about; give its folder with --data, or fetch the published one: "
            "fetch nieh"
        )
    return open_set(str(data or default_folder()), trajectories)


def _bundled_folder(name: str) -> Path:
    """Return the folder of a bundled set with its frames."""
    folder = packaged_folder(f"sets/{name}")
    if not is_undrawn(folder):
        return folder
    if not is_drawn(folder):
        raise UsageError(
            f"the frames of {name} are not drawn on this machine yet; `infthor-eval --model oracle "
            f"--tasks {name}` draws them, once"
        )
    return drawn_folder(folder)


def find_samples(config: Mapping[str, Any], limit: int | None = None) -> TaskSamples:
    """Return the samples of a task.

    Args:
        config: `dataset_kwargs` of the task file with the options of the run: name of the context
            (the clue frames, if none is named), arguments of `find_set`, and settings of the
            context (`infthor_eval.nieh.contexts.ContextSettings`).
        limit: number of questions, chosen evenly from all trajectories by the seed; None for all.
    """
    name = config.get("context", DEFAULT_CONTEXT)
    context = context_named(name)
    settings = read(ContextSettings, config)
    data = find_set(**config)
    check_prompt(name, settings.words)
    frame_ablation = FrameAblation(settings.frames, settings.seed)
    frame_ablation.check(data)
    items = [
        sample
        for of_question in _by_question(data, context, settings, limit)
        for sample in of_question
    ]
    samples = [sample for sample in items if isinstance(sample, QuestionVariant)]
    skipped = [sample for sample in items if isinstance(sample, SkippedQuestion)]
    sources = context.sources(data, settings)
    return TaskSamples(
        data, name, context, samples, skipped, sources, frame_ablation, settings.words
    )


_Items = list[QuestionVariant | SkippedQuestion]  # of one question


def _by_question(
    data: NiehSet, context: Context, settings: ContextSettings, limit: int | None
) -> list[_Items]:
    """Return samples by question in the set's order; with a limit, of those read to reach it.

    A limit takes whole pairs of twins, so it may take one question more.
    """

    def skip_unreadable(sample: QuestionVariant) -> QuestionVariant | SkippedQuestion:
        frames = context.select_frames(data, sample)
        problem = next(filter(None, (frame.problem for frame in frames)), None)
        return SkippedQuestion(sample.question, problem, sample.variant) if problem else sample

    by_position: dict[int, _Items] = {}
    n_asked = 0
    groups = _pairs_together(data.rows)
    in_turn = (
        groups
        if limit is None
        else [groups[at] for at in spread(groups, lambda group: group.cluster, settings.seed)]
    )
    for group in in_turn:
        for position in group.positions:
            row = data.rows[position]
            items = _samples(context, data, row, settings) if isinstance(row, Question) else [row]
            by_position[position] = [
                skip_unreadable(sample) if isinstance(sample, QuestionVariant) else sample
                for sample in items
            ]
            n_asked += any(isinstance(sample, QuestionVariant) for sample in by_position[position])
        if limit is not None and n_asked >= limit:
            break
    return [by_position[position] for position in sorted(by_position)]


class _Together(NamedTuple):
    """Positions of questions that a limit takes together: both of a pair, or one alone."""

    cluster: str
    positions: list[int]


def _pairs_together(rows: Sequence[Question | SkippedQuestion]) -> list[_Together]:
    groups: dict[tuple[str, int], _Together] = {}
    for position, row in enumerate(rows):
        question = row.question if isinstance(row, SkippedQuestion) else row
        key = (question.pair, 0) if question.pair else ("", position)
        groups.setdefault(key, _Together(question.cluster, [])).positions.append(position)
    return list(groups.values())


def _samples(
    context: Context, data: NiehSet, question: Question, settings: ContextSettings
) -> _Items:
    try:
        return context.samples(data, question, settings)
    except DataError as error:  # in this trajectory's frames; questions on others can be asked
        return [SkippedQuestion(question, str(error))]
