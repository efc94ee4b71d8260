"""Replies that others made, as runs: scored, with journal and results like runs of our own."""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

from infthor_eval.errors import UsageError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.question import Question, SkippedQuestion
from infthor_eval.formats.replies.logged import LoggedReply, UnreadRow
from infthor_eval.formats.replies.logs import read_reply_log
from infthor_eval.nieh.config import MetricsConfig, NiehConfig, NiehTaskConfig
from infthor_eval.nieh.contexts import CONTEXTS
from infthor_eval.nieh.guessing.blind import find_floor, visible_knowledge
from infthor_eval.nieh.options import FRAMES, SHOWN
from infthor_eval.nieh.prompts import PUBLISHED_LOGS, PUBLISHED_MAIN
from infthor_eval.nieh.records import BlindGuess, NiehAnswer, ShownClues
from infthor_eval.nieh.scoring import SCORERS, scores
from infthor_eval.nieh.twins import twin_of_reply
from infthor_eval.runs import Catalog, RunHeader, Session, Tokens, Unit, UnitKey, UnitRecord
from infthor_eval.storage.digests import digest_of_file, fingerprint
from model_adapters import Reply, answer_of

_PUBLISHED_NAME = re.compile(
    r"eval_(?P<file>qa_set_.+?_clue)_(?P<model>.+?)_(?:full_traj.*)\.log(?:\.gz)?$"
)
_RATE = re.compile(r"_fps(?P<fps>\d{1,4})(?!\d)")
# Begins the names of tasks that ask as published logs were asked.
_PUBLISHED_TASK = "nieh_published_"
# Published modes: the task of ours, and its context.
_MODES = {
    None: ("nieh_full", "trajectory"),
    "full_traj": ("nieh_full", "trajectory"),
    "truncate_head": ("nieh_truncate_head", "truncate_head"),
    "clip_retrieval": ("nieh_clip_retrieval", "clip_retrieval"),
    "video": ("nieh_video", "video"),
}
_OTHER = ("imported", "imported")  # of logs that name no mode
_PER_FRAME = 123  # of 300x300 pixels: 121 and two marks
_PER_PAIR = 144  # of two frames of a film; beside them two marks a request
_MARKS = 2
# Tokens of the chat template and the prompt's own words, by prompt;
# tests/nieh/published/test_asked_prompt.py counts them with the public vocabulary.
_OF_FRAMES = {PUBLISHED_MAIN: 52, PUBLISHED_LOGS: 60}
_OF_FILMS = {PUBLISHED_MAIN: 54}
_MOST_SPLITS = 7  # the prompts' distance less one
_WHOLE = (None, "full_traj")  # published modes that show all frames; early logs name no mode


@dataclass(frozen=True)
class Refusal:
    """A row that is not imported, with its place and the reason."""

    log: Path
    line: int
    reason: str


@dataclass
class ImportedRun:
    """The replies of one model in one mode.

    Attributes:
        model: name of the model.
        task: name of the task of ours that the mode is; "imported" if the log names none.
        settings: settings of the task's context, as `dataset_kwargs` of a task file has them; of
            published logs with the prompt that they were asked with, None if their counts of tokens
            do not tell.
        logs: the logs.
        frames: the frame ablation that it was asked under.
        records: a record per imported reply.
        refused: the rows that are not imported.
        rescored: rows whose logged score is not that of the reference scorer.
        question_ids: ids of the questions that the logs are about.
    """

    model: str
    task: str
    settings: Mapping[str, Any]
    frames: str = SHOWN
    logs: list[Path] = field(default_factory=list)
    records: list[UnitRecord[NiehAnswer]] = field(default_factory=list)
    refused: list[Refusal] = field(default_factory=list)
    rescored: list[Refusal] = field(default_factory=list)
    question_ids: set[str] = field(default_factory=set)

    @property
    def n_missing(self) -> int:
        """Number of questions without a reply."""
        return len(self.question_ids) - len({record.id for record in self.records})

    def make_records(self, _: Session[NiehAnswer]) -> list[UnitRecord[NiehAnswer]]:
        """Return the records, see `store_run`."""
        return self.records

    def header(self, data: NiehSet) -> RunHeader[NiehConfig]:
        """Return the header of the run: the model's name, the mode, and the digests of the logs."""
        task = NiehTaskConfig(
            settings={"task": self.task, "dataset_kwargs": dict(self.settings)},
            decoding={"max_new_tokens": None},
            metrics=MetricsConfig(names=SCORERS),
            data=data.fingerprint,
            simulator=data.simulator,
            sources={"logs": {log.name: digest_of_file(log) for log in self.logs}},
            n_samples=len(self.question_ids),
            skipped=(),
        )
        config = NiehConfig(tasks={self.task: task}, frames=self.frames)
        model = {"name": self.model, "imported": True}
        return RunHeader(
            suite="nieh",
            name=self.model,
            config=config.complete("nieh", model),
            units_by_task={self.task: len(self.question_ids)},
        )


@dataclass(frozen=True)
class _Known:
    """What is known of the questions: their set, what `blind` says to them by id, and numbers of
    frames by trajectory."""

    data: NiehSet
    blind: Mapping[str, BlindGuess]
    n_frames: Mapping[str, int]

    def length(self, question: Question) -> int | None:
        """Return the number of frames up to a question's moment; None if neither a log nor the set
        tells."""
        traj_id = question.traj_id
        if traj_id in self.n_frames or not self.data.has_frames:
            return self.n_frames.get(traj_id)
        return len(self.data.frames_until(question))


def import_logs(
    logs: Sequence[Path],
    data: NiehSet,
    model: str | None = None,
    tasks: Collection[str] | None = None,
) -> list[ImportedRun]:
    """Return the runs in logs: those of one model and mode, on different questions, are one run.

    Args:
        logs: files with replies (`infthor_eval.formats.replies.logs`).
        data: the set that they answer.
        model: name of the model; None for the one in the names of published logs.
        tasks: tasks of the set; replies that name another one are left out. None for any task.
    """
    runs: dict[tuple[str, ...], ImportedRun] = {}
    rows_of = {log: list(read_reply_log(log)) for log in dict.fromkeys(logs)}
    replies_of = {log: _replies(rows) for log, rows in rows_of.items()}
    n_frames = _trajectory_lengths(chain.from_iterable(replies_of.values()))
    for log in logs:
        name = _PUBLISHED_NAME.match(log.name)
        for part in _parts_of(rows_of[log]):
            first = next(iter(_replies(part)), None)
            if tasks is not None and first and first.task and first.task not in tasks:
                continue
            of_model = model or (name and name["model"]) or (first.model if first else "")
            if first and not of_model:
                raise UsageError(f"{log}: its name has no model; give one with --model")
            (task, settings) = _mode_of(_replies(part), log)
            if any(reply.published for reply in _replies(part)):
                settings["prompt"] = asked_prompt(_replies(part))
                task = _published_task(settings) or task
            frames = first.frame_ablation if first else ""
            run = runs.setdefault(
                (of_model, task, repr(settings), frames),
                ImportedRun(of_model, task, settings, frames if frames in FRAMES else SHOWN),
            )
            blind = find_floor(data, visible_knowledge(settings["context"]))
            known = _Known(data, blind, n_frames)
            _add_log(run, log, part, _questions_of(data, name), known)
    return list(runs.values())


def _parts_of(rows: Sequence[LoggedReply | UnreadRow]) -> list[list[LoggedReply | UnreadRow]]:
    """Return the rows of a log by who asked what; lines that are no replies are with the first."""
    parts: dict[tuple[str, ...], list[LoggedReply | UnreadRow]] = {}
    unread = [row for row in rows if isinstance(row, UnreadRow)]
    for reply in _replies(rows):
        key = reply.model, reply.task, reply.context, reply.frame_ablation
        parts.setdefault(key, []).append(reply)
    first, *others = parts.values() or [[]]
    return [sorted([*first, *unread], key=lambda row: row.line), *others]


def _replies(rows: Sequence[LoggedReply | UnreadRow]) -> list[LoggedReply]:
    return [row for row in rows if isinstance(row, LoggedReply)]


def _trajectory_lengths(replies: Iterable[LoggedReply]) -> dict[str, int]:
    """Return trajectories' numbers of frames, from published rows on whole ones or their ends."""
    lengths: dict[str, int] = {}
    for reply in replies:
        n_frames = None
        if reply.mode in _WHOLE:
            n_frames = reply.n_frames
        elif reply.mode == "truncate_head" and reply.frames:
            n_frames = max(reply.frames) + 1
        if reply.published and n_frames:
            lengths[reply.published.traj_id] = n_frames
    return lengths


def _mode_of(replies: Sequence[LoggedReply], log: Path) -> tuple[str, dict[str, Any]]:
    """Return task and context settings by a log's first row; general ones if unpublished."""
    first = next((reply for reply in replies if reply.published), None)
    if first is None:
        told = next(iter(replies), None)
        task, context = ("", "") if told is None else (told.task, told.context)
        return task or _OTHER[0], {"context": context if context in CONTEXTS else _OTHER[1]}
    if first.mode not in _MODES:
        raise UsageError(
            f"{log}: the mode {first.mode!r:.40} is unknown; there are "
            f"{', '.join(filter(None, _MODES))}"
        )
    task, context = _MODES[first.mode]
    if context == "truncate_head" and first.size:
        return f"{task}_{first.size:g}k", {"context": context, "ctx_size": first.size}
    rate = _RATE.search(log.name)
    if context == "video" and rate:
        fps = float(rate["fps"])
        return task if fps == 1 else f"{task}_{fps:g}fps", {"context": context, "fps": fps}
    if context == "clip_retrieval" and first.n_frames:
        return task, {"context": context, "top_k": max(reply.n_frames or 0 for reply in replies)}
    return task, {"context": context}


def _published_task(settings: Mapping[str, Any]) -> str | None:
    """Return our task that asks as a published row was made; None if none has these settings."""
    tasks = [
        task
        for name, task in Catalog.find_packaged().tasks.items()
        if name.startswith(_PUBLISHED_TASK)
    ]
    return next((task.name for task in tasks if task.settings["dataset_kwargs"] == settings), None)


def _questions_of(
    data: NiehSet, name: re.Match[str] | None
) -> Sequence[Question | SkippedQuestion]:
    """Return the rows that a log counts: those of the file in its name, else of the whole set."""
    if name is None or name["file"] not in data.files:
        return [question for questions in data.files.values() for question in questions]
    return data.files[name["file"]]


def _add_log(
    run: ImportedRun,
    log: Path,
    rows: Sequence[LoggedReply | UnreadRow],
    questions: Sequence[Question | SkippedQuestion],
    known: _Known,
) -> None:
    by_id = {question.id: question for question in questions if isinstance(question, Question)}
    answered = {record.key for record in run.records}
    n_before = len(run.records)
    refused = []
    for row in rows:
        question = _find_question(row, questions, by_id)
        if isinstance(question, str):
            refused.append(Refusal(log, row.line, question))
        elif isinstance(row, LoggedReply):
            record = _imported_record(run.task, question, row, known)
            if record.key in answered:
                reason = f"answers {question.id} again; the first reply is kept"
                refused.append(Refusal(log, row.line, reason))
                continue
            answered.add(record.key)
            run.records.append(record)
            run.rescored += _compare_scores(log, row, record)
    if len(run.records) == n_before:
        reasons = (
            "; ".join(dict.fromkeys(refusal.reason for refusal in refused[:3])) or "it is empty"
        )
        raise UsageError(
            f"{log}: no row answers a question of this set ({reasons}); give the set that it is "
            "about"
        )
    run.logs.append(log)
    run.refused += refused
    run.question_ids.update(by_id)


def _find_question(
    row: LoggedReply | UnreadRow,
    questions: Sequence[Question | SkippedQuestion],
    by_id: Mapping[str, Question],
) -> Question | str:
    """Return the question of a row, or the reason why it has none."""
    if isinstance(row, UnreadRow):
        return row.reason
    if row.question_id is not None:
        return (
            by_id.get(row.question_id)
            or f"answers {row.question_id!r:.80}, which is not in the set"
        )
    if row.row is None or not 0 <= row.row < len(questions):
        return f"answers question {row.row}; the file has {len(questions)}"
    question = questions[row.row]
    published = row.published
    if isinstance(question, SkippedQuestion):
        return question.reason
    if published and (published.traj_id, published.text, published.clues, published.answers) != (
        question.traj_id,
        question.text,
        question.clues,
        question.answers,
    ):
        return f"answers another question than row {row.row} of the file"
    return question


def _compare_scores(
    log: Path, reply: LoggedReply, record: UnitRecord[NiehAnswer]
) -> Iterator[Refusal]:
    if reply.score is None:
        return
    ours = record.payload.scores["reference"]
    if abs(reply.score - ours) > 1e-9:
        yield Refusal(
            log, reply.line, f"has the score {reply.score:g}; the reference scorer gives {ours:g}"
        )


def asked_prompt(replies: Iterable[LoggedReply]) -> str | None:
    """Return the prompt that fits every row; None if none does, or if a row does not tell.

    A request is frames, the chat template, the words of a prompt, and the question. The tokens of
    all but the question are known, as Qwen2.5-VL counts them; the question has at least one for
    each word and one for its mark. So what is left over is how often its words were split: 0 to 4
    times in each of the 1,303 published questions. The two prompts of frames are 8 tokens apart,
    hence each row fits one of them at most, without the model's vocabulary.
    """
    fitting = [_fitting(reply) for reply in replies if reply.published]
    prompts = set(fitting)
    return prompts.pop() if len(prompts) == 1 else None


def _fitting(reply: LoggedReply) -> str | None:
    if reply.published is None or reply.n_context_tokens is None:
        return None
    known: Mapping[str, int]
    # Rows of videos do not count frames, and no text is as long as a pair of them.
    if reply.mode == "video":
        n_text = reply.n_context_tokens % _PER_PAIR - _MARKS
        known = _OF_FILMS
    elif reply.n_frames is None:
        return None
    else:
        n_text = reply.n_context_tokens - _PER_FRAME * reply.n_frames
        known = _OF_FRAMES
    n_least = len(reply.published.text.split()) + 1
    return next(
        (prompt for prompt, n in known.items() if 0 <= n_text - n - n_least <= _MOST_SPLITS), None
    )


def _imported_record(
    task: str, question: Question, reply: LoggedReply, known: _Known
) -> UnitRecord[NiehAnswer]:
    """Return the record of a reply, or of why there is none, as the log says it."""
    payload = NiehAnswer.of(
        question,
        known.blind.get(question.id),
        _shown_clues(question, reply, known),
        twin_of_reply(known.data, question, reply.frames),
    )
    key = UnitKey(task, question.id, reply.variant, reply.repeat)
    unit = Unit(key, question.cluster, payload)
    tokens = Tokens(context=reply.n_context_tokens, reply=reply.n_reply_tokens)
    if reply.failure is not None:
        made_of = {"question": question.id, "failure": reply.failure}
        return unit.record_failure(reply.failure, fingerprint(made_of), seconds=reply.seconds)
    thinking, answer = answer_of(Reply(reply.text, thinking=reply.thinking))
    return unit.record(
        fingerprint({"question": question.id, "reply": reply.text}),
        payload.with_reply(answer, scores(answer, question.answers), thinking),
        seconds=reply.seconds,
        tokens=tokens,
    )


def _shown_clues(question: Question, reply: LoggedReply, known: _Known) -> ShownClues | None:
    """Return the clue frames shown; None if the row does not tell, or if no frame is evidence."""
    clues = set(question.clues)
    is_whole = reply.published is not None and reply.mode in _WHOLE
    if question.absence or (reply.frames is None and not is_whole):
        return None
    n_frames = known.length(question)
    n_shown = len(clues if reply.frames is None else clues.intersection(reply.frames))
    # A log of a model that takes only some frames counts these alone, and a clue can lie beyond.
    n_after = None if n_frames is None or n_frames <= max(clues) else n_frames - 1 - max(clues)
    return ShownClues(n_shown=n_shown, n_clues=len(clues), n_after=n_after)
