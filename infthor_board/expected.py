"""What a run of a task should have, by the checker's own task files and sets."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from infthor_board.reading import SubmittedRun
from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.replies.answer_key import AnswerKey, read_key
from infthor_eval.memory import MEMORIES
from infthor_eval.nieh import contexts
from infthor_eval.nieh.config import NiehConfig, NiehTaskConfig
from infthor_eval.nieh.guessing.blind import find_floor, visible_knowledge
from infthor_eval.nieh.options import NiehOptions
from infthor_eval.nieh.records import NiehAnswer
from infthor_eval.nieh.rescoring.keyed import keyed_payload
from infthor_eval.nieh.samples import find_set
from infthor_eval.nieh.scoring import scores
from infthor_eval.nieh.task import NiehTask, PreparedTask
from infthor_eval.nieh.units import NiehUnit
from infthor_eval.runs import Catalog, TaskFile, TaskRequest, UnitKey, UnitRecord
from infthor_eval.settings import config_values

Record = UnitRecord[NiehAnswer]
_SUITE = "nieh"
_MOST_UNITS = 10_000  # that a run may lack nearly all of, which the checks then say


@dataclass(frozen=True)
class Expected:
    """One task of a submitted run, set up anew.

    Attributes:
        name: name of the task.
        run: the run.
        config: what the run should say of the task; None of an export.
        units: its units by their keys, made of our set.
        data: our set.
        key: the key, where our set is the public part of a private one; else None.
    """

    name: str
    run: SubmittedRun
    config: NiehTaskConfig | None
    units: Mapping[UnitKey, NiehUnit]
    data: NiehSet
    key: AnswerKey | None = None

    @property
    def graded_data(self) -> NiehSet:
        """The set with the answers."""
        return self.data if self.key is None else self.key.data

    @property
    def stated(self) -> NiehTaskConfig:
        """What the run says of the task."""
        return self.run.header.config.tasks[self.name]

    @property
    def records(self) -> list[Record]:
        """The submitted records of the task."""
        return [record for record in self.run.records if record.task == self.name]

    @cached_property
    def graded(self) -> list[Record]:
        """The replies to our questions, scored by us; a unit without a reply is a failed one.

        Nothing but the reply, its tokens and times is taken from the submission.
        """
        given = {record.key: record for record in self.records}
        return [_grade(self._keyed(unit), given.get(key)) for key, unit in self.units.items()]

    def _keyed(self, unit: NiehUnit) -> NiehUnit:
        """Return a unit with the answers of the key, if there is one."""
        if self.key is None:
            return unit
        key = self.key
        question = key.question(unit.key.id)
        knowledge = visible_knowledge(self.stated.context)
        return dataclasses.replace(
            unit,
            cluster=question.cluster,
            payload=keyed_payload(unit.payload, unit.key.id, key, unit.sample.frames),
            find_blind=lambda: find_floor(key.data, knowledge).get(question.id),
        )


def _grade(unit: NiehUnit, given: Record | None) -> Record:
    reply = None if given is None else given.payload.reply
    if given is None or reply is None or given.state != "answered":
        reason = "no reply" if given is None else given.failure or "no reply"
        return unit.record_failure(reason)
    payload = unit.payload.with_reply(
        reply, scores(reply, unit.payload.answers), given.payload.thinking
    )
    recalled = replace(payload, recall=given.payload.recall)
    return unit.record(
        given.fingerprint, recalled, seconds=given.seconds, tokens=given.tokens, usage=given.usage
    )


class Owner:
    """Who checks: the installed tasks, and sets of one's own for tasks without a bundled one."""

    def __init__(
        self,
        sets: Sequence[Path] = (),
        include: Sequence[Path] = (),
        key: Path | None = None,
    ) -> None:
        """Open the sets and the key, and find the task files below further folders."""
        self._sets = [NiehSet(path) for path in sets]
        self._key = None if key is None else read_key(key)
        self._catalog = Catalog.find_installed(include)

    def find_set(self, task: str, fingerprint: str | None = None) -> NiehSet:
        """Return the set that a task asks about: the bundled one, or the given one.

        Args:
            task: name of the task.
            fingerprint: that of the set that a run says it used; of several given ones it is taken.
        """
        file = self._file(task)
        bundled = file.settings["dataset_kwargs"].get("bundled")
        if bundled:
            return find_set(bundled=bundled)
        if not self._sets:
            raise UsageError(f"{task}: asks about a set of one's own; give it with --data SET")
        matching = (data for data in self._sets if data.fingerprint == fingerprint)
        return next(matching, self._sets[0])

    def expect(self, run: SubmittedRun) -> Iterator[Expected]:
        """Yield each task of a run, set up anew."""
        for name, config in run.header.config.tasks.items():
            yield self._expect(run, name, config)

    def _file(self, task: str) -> TaskFile:
        file = self._catalog.tasks.get(task)
        if file is None or file.suite != _SUITE:
            raise UsageError(
                f"{task}: no task of {_SUITE} that is known here; submit runs of `ls tasks`"
            )
        return file

    def _expect(self, run: SubmittedRun, name: str, config: NiehTaskConfig) -> Expected:
        config_of_run = run.header.config
        _refuse_others_memory(name, config_of_run)
        data = self.find_set(name, config.data)
        file = self._file(name)
        options = _options(config_of_run, config, file)
        request = TaskRequest(
            tasks=[_without_models(file, options)],
            options=options,
            data=data.root,
            seed=config_of_run.seed or 0,
        )
        task = NiehTask(request.tasks[0], request)
        ready = task.prepare(config_of_run.tokens_per_frame)
        if not ready.task_samples.samples:
            raise DataError(f"{data.root}: no question of it can be asked in {name}; fix the set")
        ours = None
        if not run.is_export:
            film = None if config.film is None else config.film == "video"
            ours = replace(task.config(ready, film), settings=_settings(file, options))
        return Expected(name, run, ours, _units(name, ready, run), data, self._key_of(data))

    def _key_of(self, data: NiehSet) -> AnswerKey | None:
        """Return the key of a set that withholds its answers; None for any other."""
        if not any(question.is_withheld for question in data.questions):
            return None
        if self._key is None or self._key.public != data.fingerprint:
            raise UsageError(
                f"{data.root}: withholds its answers; give its key with --key, or send the "
                "submission to the owner of the set"
            )
        return self._key


def _refuse_others_memory(name: str, run: NiehConfig) -> None:
    """Refuse a memory that has no name here: what strangers send is read, and never run."""
    if run.memory is not None and run.memory not in MEMORIES.names:
        raise UsageError(
            f"{name}: its memory {run.memory!r:.60} is code in a file, which is not run here, or "
            "not installed; send replies with a memory of `ls memories`"
        )


def _without_models(file: TaskFile, options: NiehOptions) -> TaskFile:
    """Return a task that is set up without the model that chooses its frames, which a stranger may
    have named: what a memory recalled is in the records, and retrieved frames are nowhere."""
    own = file.settings["dataset_kwargs"]
    stand_in: dict[str, Any] = {}
    match own.get("context", options.context):
        case contexts.RETRIEVED:
            stand_in = {"context": "trajectory"}
        case contexts.MEMORY:
            stand_in = {"memory": "none", "memory_args": {}}
    return dataclasses.replace(file, settings={**file.settings, "dataset_kwargs": own | stand_in})


def _settings(file: TaskFile, options: NiehOptions) -> dict[str, Any]:
    """Return the settings of a task as a run of it has them."""
    given = {"context": options.context, "ctx_size": options.ctx_size}
    known = {name: value for name, value in given.items() if value is not None}
    return {**file.settings, "dataset_kwargs": known | file.settings["dataset_kwargs"]}


def _options(run: NiehConfig, task: NiehTaskConfig, file: TaskFile) -> NiehOptions:
    kept = config_values(NiehOptions()).keys() - {"repeats"}
    given: dict[str, Any] = {
        name: value for name in kept if (value := getattr(run, name)) not in (None, "")
    }
    if file.settings["dataset_kwargs"].get("leaves_open") == "context":
        own = task.dataset_kwargs
        given |= {name: own[name] for name in ("context", "ctx_size") if name in own}
    return NiehOptions(**given)


def _units(name: str, ready: PreparedTask, run: SubmittedRun) -> dict[UnitKey, NiehUnit]:
    """Return the units that a run should have; exports say by their rows alone how often each
    question was asked."""
    n_repeats = run.header.config.repeats
    if run.is_export:
        n_repeats = max((record.repeat for record in run.records), default=1)
    samples = ready.task_samples.samples
    # Of a number alone nothing is listed: there are records for it.
    if n_repeats > 1 and len(samples) * n_repeats > _MOST_UNITS + 2 * len(run.records):
        raise DataError(
            f"{name}: says that {len(samples):,} questions were asked {n_repeats:,} times, and has "
            f"{len(run.records):,} replies; send all of them, or say how often"
        )
    units = [
        NiehUnit.of(name, ready.task_samples, sample, repeat)
        for sample in samples
        for repeat in range(1, n_repeats + 1)
    ]
    return {unit.key: unit for unit in units}
