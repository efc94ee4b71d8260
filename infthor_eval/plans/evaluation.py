"""Plans set up for a run, and the run of their trajectories."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from itertools import groupby

from infthor_eval.episodes.evaluation import BoundEpisodes, EpisodeEvaluation, EpisodeUnit
from infthor_eval.episodes.records import NOT_ATTEMPTED
from infthor_eval.episodes.running import EpisodeResult
from infthor_eval.errors import UsageError
from infthor_eval.plans.actors.factory import ActorFactory, actor_factory
from infthor_eval.plans.config import PlansConfig
from infthor_eval.plans.options import PlansOptions
from infthor_eval.plans.plan import Plan
from infthor_eval.plans.published.final_protocol import FinalForm
from infthor_eval.plans.records import PlanRecord
from infthor_eval.plans.runner import PlanRunner, plan_record
from infthor_eval.plans.task import PlansTask
from infthor_eval.plans.trajectories import PlanTrajectory
from infthor_eval.runs import Group, RunHeader, Session, TaskRequest, UnitDoc, UnitRecord
from infthor_eval.storage.scratch import ScratchFolder
from model_adapters import Model, Subject, check_decoding

PlanUnit = EpisodeUnit[PlanRecord, PlanTrajectory, Plan]


class PlansEvaluation(EpisodeEvaluation[PlansOptions, PlansTask, PlanUnit]):
    """Plans set up for a run; see `infthor_eval.runs.Evaluation`."""

    def __init__(self, request: TaskRequest[PlansOptions]) -> None:
        super().__init__(request, PlansTask)

    @property
    def units(self) -> list[PlanUnit]:
        """See `EpisodeEvaluation`."""
        return [
            PlanUnit.of(name, trajectory, plan, plan_record(trajectory, plan))
            for name, task in self.tasks.items()
            for trajectory in task.evaluated_trajectories
            for plan in task.plans(trajectory)
        ]

    @property
    def config(self) -> PlansConfig:
        """See `EpisodeEvaluation`."""
        return PlansConfig(**self._shared_config, constrained=self.options.constrained)

    def bind(self, subject: Subject) -> "BoundPlans":
        """See `infthor_eval.runs.Evaluation.bind`."""
        if isinstance(subject, Model):
            _refuse_incapable(subject, self.options, self.tasks.values())
        return BoundPlans(self, actor_factory(subject, self.trajectories))

    def to_doc(self, header: RunHeader[PlansConfig], record: UnitRecord[PlanRecord]) -> UnitDoc:
        """See `infthor_eval.runs.Evaluation.to_doc`."""
        payload = record.payload
        task = self.tasks[record.task]
        return UnitDoc(
            number=self._numbers[record.key],
            doc={
                "traj_id": record.cluster,
                "plan": payload.index,
                "kind": payload.kind,
                "goal": payload.goal,
            },
            target=payload.plan,
            prompt=f"{payload.goal}\n{payload.plan}",
            settings=task.file.settings["generation_kwargs"],
            reply=", ".join(step.action or (step.reply or "") for step in payload.steps),
        )


class BoundPlans(BoundEpisodes[PlanUnit, PlanRecord]):
    """Plans for one subject; see `infthor_eval.runs.BoundEvaluation`."""

    def __init__(self, evaluation: PlansEvaluation, factory: ActorFactory) -> None:
        """Take the work, and what creates the subject's actors."""
        self._tasks = evaluation.tasks
        self._factory = factory
        # Nothing is rendered that nobody looks at; masks are for the state in words alone.
        in_words = factory.sees and any(task.history.needs_state for task in self._tasks.values())
        self._simulators = evaluation.simulators(image=factory.sees, instances=in_words)
        # A trajectory is a group: its plans share a history, in simulator and prefix cache.
        groups = groupby(evaluation.units, lambda unit: (unit.key.task, unit.cluster))
        warnings = _warnings(factory.trained_words, self._tasks.values())
        workload = evaluation.workload(same for _, same in groups)
        workload = replace(workload, warnings=warnings)
        super().__init__(evaluation, workload, [self._simulators])

    def run(
        self, group: Group[PlanUnit], session: Session[PlanRecord]
    ) -> Iterator[UnitRecord[PlanRecord]]:
        """See `infthor_eval.runs.BoundEvaluation.run`."""
        fingerprints, known = self._find_records(group, session)
        if all(record is not None for record in known.values()):
            yield from (record for record in known.values() if record is not None)
            return
        task = self._tasks[group.units[0].key.task]
        trajectory = group.units[0].trajectory
        with self._simulators.one() as simulator, ScratchFolder() as folder:
            runner = PlanRunner(task, trajectory, self._factory, simulator, folder, self.seed)
            if task.final_form is not None:
                yield from self._run_in_one_go(group, task.final_form, runner, session)
                return
            stopped = lost = False
            for unit in group.units:
                record = known[unit.key]
                # A plan that was not attempted is, once an earlier one that had no result is done.
                if record is None or (record.payload.ended == NOT_ATTEMPTED and not stopped):
                    if lost:
                        record = _not_asked(unit, fingerprints[unit.key])
                    else:
                        run = partial(runner.pass_over if stopped else runner.run, unit.episode)
                        record = runner.record(unit, fingerprints[unit.key], run, session)
                yield record
                if task.settings.after_failure == "stop":
                    lost = lost or record.state in ("failed", "not asked")
                    stopped = stopped or (record.state == "answered" and not record.payload.done)

    def _run_in_one_go(
        self,
        group: Group[PlanUnit],
        form: FinalForm,
        runner: PlanRunner,
        session: Session[PlanRecord],
    ) -> Iterator[UnitRecord[PlanRecord]]:
        """Run all plans of a final task as the published scripts do, even if some have records."""
        fingerprints, known = self._find_records(group, session)
        tried = 0
        goes_on = True
        lost = False
        for unit in group.units:
            if lost:
                yield known[unit.key] or _not_asked(unit, fingerprints[unit.key])
                continue
            if not tried:
                run: Callable[[], EpisodeResult[PlanRecord]] = partial(
                    self._first_of_all, runner, group, unit
                )
            elif goes_on:
                run = partial(runner.run, unit.episode, goes_on=True)
            else:
                run = partial(runner.pass_over, unit.episode)
            record = runner.record(unit, fingerprints[unit.key], run, session)
            tried += record.payload.attempted
            # After a failure of the model or the simulator nobody knows where the world is.
            lost = record.state in ("failed", "not asked")
            goes_on = form.goes_on and goes_on and record.payload.attempted
            yield known[unit.key] or record

    @staticmethod
    def _first_of_all(
        runner: PlanRunner, group: Group[PlanUnit], unit: PlanUnit
    ) -> EpisodeResult[PlanRecord]:
        runner.prepare([other.episode for other in group.units])
        return runner.run(unit.episode)


def _refuse_incapable(model: Model, options: PlansOptions, tasks: Iterable[PlansTask]) -> None:
    """Refuse a model every reply of which would fail."""
    if options.constrained and not model.capabilities.choices:
        raise UsageError(f"--constrained: {model.name} cannot be held to choices; leave it out")
    for task in tasks:
        if task.counting and not model.capabilities.counts_tokens:
            raise UsageError(
                f"{task.counting}: {model.name} counts no tokens; take --history full, or leave "
                "out the budget"
            )
        if not (task.decoding.greedy or model.capabilities.sampling):
            raise UsageError(
                f"{model.name} draws no replies, as {task.name} does at temperature "
                f"{task.decoding.temperature:g}; add --greedy"
            )
        check_decoding(f"{task.name}: {model.name}", model.capabilities, task.decoding)


def _not_asked(unit: PlanUnit, fingerprint: str) -> UnitRecord[PlanRecord]:
    """Return the record of a plan after one without a result: nobody knows whether it would have
    been reached."""
    reason = "not asked: an earlier plan of the trajectory has no result; run the command again"
    return unit.record_failure(reason, fingerprint, asked=False)


def _warnings(trained: str | None, tasks: Iterable[PlansTask]) -> list[str]:
    """Return a line for each task that asks a checkpoint in other words than it was trained on."""
    return [
        f"{task.name}: the checkpoint was trained on {trained} words and is asked in {task.words} "
        f"ones; give --words {trained}"
        for task in tasks
        if trained is not None and trained != task.words
    ]
