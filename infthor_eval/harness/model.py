"""Our models under lm-eval's own command: `lm-eval run --model infthor --model_args adapter=qwen2.5-vl-tiny,...`."""

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

from lm_eval.api.instance import Instance
from lm_eval.api.model import LM

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.formats.scratch import ScratchFolder
from infthor_eval.harness.manipulation_task import arm_evaluation, arm_response
from infthor_eval.harness.plans_task import episode_response, evaluation_around
from infthor_eval.harness.registration import NAME, say_model_takes_references
from infthor_eval.manipulation import records as arm_records
from infthor_eval.manipulation.evaluation import ArmUnit, BoundManipulation
from infthor_eval.nieh import records as nieh_records
from infthor_eval.nieh.answering import ModelAnswerer, NiehUnit, answered
from infthor_eval.nieh.baselines import BASELINES
from infthor_eval.nieh.docs import sample_of, samples_around
from infthor_eval.nieh.task import PreparedTask
from infthor_eval.plans import records as plan_records
from infthor_eval.plans.evaluation import BoundPlans, PlanUnit
from infthor_eval.runs import Group, RunHeader
from infthor_eval.runs.generation_kwargs import decoding_of
from infthor_eval.runs.journal import Journal
from infthor_eval.runs.records import UnitKey
from infthor_eval.runs.run_config import run_config
from infthor_eval.runs.session import JournalSession
from model_adapters import Model, Policy, adapter_identity, has_option, label, load

__all__ = ["InfthorLM"]

_RECORDS = {"nieh": nieh_records.RECORDS, "plans": plan_records.RECORDS, "manipulation": arm_records.RECORDS}
_DEFAULT_DEVICE = "cuda:0"  # what lm-eval says where nobody said anything


class InfthorLM(LM):
    """Any model of ours, by name, for a command that is not ours.

    Requests are answered in the order that shares most, and each is recorded before the next is begun: lm-eval sorts
    them by the length of their text, which scatters the questions on one trajectory; here they are grouped again.
    Requests refer to their frames through the doc; images in them are not looked at.
    """

    MULTIMODAL = True  # lm-eval asks before it hands over a task with images

    def __init__(
        self,
        adapter: str,
        journal: str | None = None,
        seed: int = 0,
        batch_size: int | str | None = None,
        max_batch_size: int | None = None,
        device: str | None = None,
        **options: object,
    ) -> None:
        """Load a model.

        Args:
            adapter: name of the model (`infthor-eval ls models`).
            journal: folder of a run, to go on where an earlier one stopped; None keeps it for this process only.
            seed: for whatever is random in the model.
            batch_size: lm-eval's; passed on to models that take one.
            max_batch_size: lm-eval's; not looked at.
            device: lm-eval's; passed on to models that take one, unless it is what lm-eval says by default.
            options: the model's options.

        Raises:
            UsageError: an unknown name or option, or a baseline, which needs the answer key that lm-eval does not give.
            ModelError: the model cannot be loaded.
        """
        super().__init__()
        if adapter in BASELINES:
            raise UsageError(f"{adapter} reads the answer key; run it with infthor-eval --model {adapter}")
        given = {key: str(value) for key, value in options.items()}
        theirs = {"device": None if device == _DEFAULT_DEVICE else device, "batch_size": _number(batch_size)}
        given |= {key: value for key, value in theirs.items() if value is not None and has_option(adapter, key)}
        say_model_takes_references()
        self._model = load(adapter, given, seed)
        self._seed = seed
        self._name, self._code = label(adapter, given), adapter_identity(adapter)
        self._scratch = ScratchFolder()
        self._folder = Path(journal) if journal else self._scratch.path
        self._sessions: dict[str, JournalSession[Any]] = {}
        self._plans: dict[str, BoundPlans] = {}
        self._groups: dict[str, dict[str, Group[PlanUnit]]] = {}
        self._arms: dict[str, tuple[BoundManipulation, list[ArmUnit]]] = {}

    @property
    def tokenizer_name(self) -> str:
        """The model's name; lm-eval keys its caches by it."""
        return self._model.name

    def get_model_info(self) -> dict[str, str]:
        """What lm-eval writes of a model beside its results."""
        return {"model_source": NAME, "model_name": self._model.name}

    def generate_until(self, requests: Sequence[Instance]) -> list[str]:
        """One response per request; empty where the model could not answer (the journal has the reason).

        A request of a task of plans or of manipulation is an episode, and is answered with what came of it.

        Raises:
            UsageError: a policy is asked anything but episodes of manipulation, or a model those.
        """
        if _are(requests, "arm_episode"):
            return self._arm_episodes(requests)
        if not isinstance(self._model, Model):
            raise UsageError(f"{self._name} cannot be talked to; it is a policy, for tasks of manipulation")
        if _are(requests, "plans"):
            return [self._episode(request) for request in requests]
        replies: dict[UnitKey, str] = {}
        units = [_unit(request) for request in requests]
        order = sorted(range(len(units)), key=lambda number: (units[number].key.task, units[number].cluster))
        for _, numbers in groupby(order, key=lambda number: (units[number].key.task, units[number].cluster)):
            replies |= self._replies(self._model, [(units[number], requests[number]) for number in numbers])
        return [replies[unit.key] for unit in units]

    def loglikelihood(self, requests: Sequence[Instance]) -> list[tuple[float, bool]]:
        """Not offered: no task of ours compares likelihoods."""
        raise ModelError("infthor-eval models answer in words; use a task with output_type generate_until")

    def loglikelihood_rolling(self, requests: Sequence[Instance]) -> list[float]:
        """Not offered, see `loglikelihood`."""
        raise ModelError("infthor-eval models answer in words; use a task with output_type generate_until")

    def _replies(self, model: Model, group: Sequence[tuple[NiehUnit, Instance]]) -> dict[UnitKey, str]:
        """Replies to the requests of one task on one trajectory."""
        unit, request = group[0]
        decoding = decoding_of(request.args[1], self._seed, unit.key.task)
        prepared = PreparedTask(samples_around(request.doc), decoding, request.args[1])
        session = self._session("nieh")
        records = answered([unit for unit, _ in group], prepared, ModelAnswerer(model, session), session)
        return {record.key: session.append_new(record)[0].payload.reply or "" for record in records}

    def _episode(self, request: Instance) -> str:
        """What came of a trajectory."""
        doc, task, session = request.doc, str(request.task_name), self._session("plans")
        if task not in self._plans:
            self._plans[task] = evaluation_around(doc, task, request.args[1], self._seed).bind(self._model)
            self._groups[task] = {group.units[0].cluster: group for group in self._plans[task].workload.groups}
        records = self._plans[task].run(self._groups[task][doc["traj_id"]], session)
        return episode_response(session.append_new(record)[0] for record in records)

    def _arm_episodes(self, requests: Sequence[Instance]) -> list[str]:
        """What came of episodes of an arm; those of one trajectory are played together."""
        if not isinstance(self._model, Policy):
            raise UsageError(
                f"{self._name} drives no arm; tasks of manipulation need a policy (openvla, spatialvla, ...)"
            )
        session, responses = self._session("manipulation"), {}
        for task, same in _by_task(requests).items():
            if task not in self._arms:
                evaluation = arm_evaluation(same[0].doc, task, self._seed)
                self._arms[task] = evaluation.bind(self._model), evaluation.units
            asked = {request.doc["arm_episode"] for request in same}
            bound, every = self._arms[task]
            units = [unit for unit in every if unit.key.id in asked]
            for _, group in groupby(units, key=lambda unit: unit.cluster):
                for record in bound.run(Group(list(group)), session):
                    responses[task, record.id] = arm_response(session.append_new(record)[0])
        return [responses[str(request.task_name), request.doc["arm_episode"]] for request in requests]

    def _session(self, suite: str) -> JournalSession[Any]:
        """Where the records of a suite go: those of NIEH into the folder itself, others into one of theirs."""
        if suite not in self._sessions:
            config = run_config(suite, self._model, self._code, {"host": "lm-eval"}, None, self._seed)
            header = RunHeader(suite=suite, name=self._name, config=config)
            folder = self._folder if suite == "nieh" else self._folder / suite
            journal = Journal(folder, header, _RECORDS[suite])
            self._sessions[suite] = JournalSession(journal)
        return self._sessions[suite]


def _are(requests: Sequence[Instance], kind: str) -> bool:
    """Whether requests are episodes of a kind, by what their docs hold."""
    return any(isinstance(request.doc, dict) and kind in request.doc for request in requests)


def _by_task(requests: Sequence[Instance]) -> dict[str, list[Instance]]:
    found: dict[str, list[Instance]] = {}
    for request in requests:
        found.setdefault(str(request.task_name), []).append(request)
    return found


def _unit(request: Instance) -> NiehUnit:
    if request.task_name is None or not isinstance(request.doc, dict) or "question_id" not in request.doc:
        raise ModelError(f"{request.task_name}: infthor-eval's models answer its own tasks (tasks/nieh) under lm-eval")
    return NiehUnit.of(request.task_name, sample_of(request.doc))


def _number(batch_size: int | str | None) -> str | None:
    """lm-eval's batch size where it is one: "auto" is nothing to us, and 1 is what every model takes by itself."""
    return str(batch_size) if str(batch_size).isdigit() and int(str(batch_size)) > 1 else None
