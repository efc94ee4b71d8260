"""One run: tasks, a model, a journal, and lm-eval as the host that drives them."""

import json
import logging
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import infthor_eval
from infthor_eval.errors import UsageError
from infthor_eval.formats.nieh_set import LeftOut, NiehSet
from infthor_eval.formats.question import Question
from infthor_eval.nieh.task import open_set, task_questions
from infthor_eval.runs.catalog import Catalog
from infthor_eval.runs.identity import fingerprint
from infthor_eval.runs.journal import Journal, Observer, UnitRecord
from model_adapters import Bound, Model, load

__all__ = ["Plan", "RunOutcome", "RunRequest", "execute", "plan"]


@dataclass(frozen=True)
class RunRequest:
    """What a user asked for.

    Attributes:
        model: name of a model.
        tasks: names of tasks and groups.
        output: folder that takes the run's own folder.
        data: folder of the NIEH set for tasks that do not bring their own.
        model_options: the model's options as typed.
        limit: ask only the first so many questions of each task.
        seed: for whatever is random.
    """

    model: str
    tasks: tuple[str, ...]
    output: Path
    data: Path | None = None
    model_options: Mapping[str, str] = field(default_factory=dict)
    limit: int | None = None
    seed: int = 0


@dataclass(frozen=True)
class TaskPlan:
    """One task: its settings, its questions, and what of the set cannot be asked."""

    name: str
    config: Mapping[str, Any]
    data: NiehSet
    questions: list[Question]
    left_out: list[LeftOut]


@dataclass(frozen=True)
class Plan:
    """A request whose names, files and questions have been found to be in order."""

    request: RunRequest
    tasks: list[TaskPlan]

    @property
    def n_units(self) -> int:
        """Questions that will be asked, over all tasks."""
        limit = self.request.limit
        return sum(len(t.questions) if limit is None else min(limit, len(t.questions)) for t in self.tasks)


@dataclass(frozen=True)
class RunOutcome:
    """A finished run: its folder, who it was, and every record."""

    folder: Path
    identity: dict[str, Any]
    records: list[UnitRecord]


def plan(request: RunRequest) -> Plan:
    """Check a request before anything expensive is loaded.

    Raises:
        UsageError: an unknown task, or a task without its data.
        DataError: the set is not what the format says.
    """
    open_set.cache_clear()  # its files may have changed since an earlier run of this process
    catalog = Catalog.packaged()
    tasks = []
    for name in catalog.expand(request.tasks):
        config = catalog.tasks[name]
        given = {"data": str(request.data)} if request.data else {}
        data, questions, left_out = task_questions(**given, **config["dataset_kwargs"])
        if not questions:
            reasons = "; ".join(sorted({item.reason for item in left_out})[:3]) or "its files are empty"
            raise UsageError(f"task {name}: {data.root} has no question that can be asked ({reasons})")
        tasks.append(TaskPlan(name, config, data, questions, left_out))
    return Plan(request, tasks)


def execute(ready: Plan, observe: Observer) -> RunOutcome:
    """Load the model, ask what the journal does not hold yet, and write the run's files.

    The folder `<output>/<model>/<tasks>-<identity>/` holds `journal.jsonl` and lm-eval's results and samples.

    Raises:
        UsageError: a wrong model name or option, or another process at the same run.
        ModelError: the model cannot be loaded.
    """
    request = ready.request
    model = load(request.model, request.model_options, request.seed)
    try:
        if isinstance(model, Bound):
            model.study([question for task in ready.tasks for question in task.questions])
        identity = _identity(ready, model)
        name = f"{'+'.join(request.tasks)}-{fingerprint(identity)}"
        folder = request.output / request.model / name
        with Journal(folder / "journal.jsonl", identity) as journal:
            _evaluate(ready, model, journal, observe, folder / "lm_eval")
            return RunOutcome(folder, identity, journal.records)
    finally:
        if isinstance(model, Model):
            model.close()


def _identity(ready: Plan, model: Model | Bound) -> dict[str, Any]:
    request = ready.request
    identity = {
        "infthor_eval": infthor_eval.__version__,
        "model": {"name": model.name, **model.identity()},
        "tasks": {task.name: _task_identity(task) for task in ready.tasks},
        "limit": request.limit,
        "seed": request.seed,
    }
    # As it is read back from the journal: tuples are lists, keys are strings.
    return dict(json.loads(json.dumps(identity)))


def _task_identity(task: TaskPlan) -> dict[str, Any]:
    return {
        "config": dict(task.config),
        "data": task.data.fingerprint,
        "simulator": task.data.simulator,
        "n_questions": len(task.questions),
        "left_out": [{"question_id": item.question.id, "reason": item.reason} for item in task.left_out],
    }


def _evaluate(
    ready: Plan,
    model: Model | Bound,
    journal: Journal,
    observe: Observer,
    output: Path,
) -> None:
    import lm_eval.models  # noqa: F401 - before anything is registered, or the built-in models vanish (0.4.13)
    from datasets.utils.logging import disable_progress_bar
    from lm_eval import simple_evaluate
    from lm_eval.loggers import EvaluationTracker
    from lm_eval.tasks import TaskManager

    from infthor_eval.runs.lm import JournaledLM

    disable_progress_bar()
    logging.getLogger("lm_eval").setLevel(logging.ERROR)
    data = ready.request.data
    tracker = EvaluationTracker(output_path=str(output))
    results = simple_evaluate(
        model=JournaledLM(model, journal, observe),
        tasks=[task.name for task in ready.tasks],
        task_manager=TaskManager(
            include_path=str(Catalog.packaged().folder),
            include_defaults=False,
            metadata={"pixels": False, **({"data": str(data)} if data else {})},
        ),
        limit=ready.request.limit,
        bootstrap_iters=0,
        evaluation_tracker=tracker,
    )
    samples = results.pop("samples")
    tracker.save_results_aggregated(results=results, samples=samples)
    for task in sorted(samples):
        tracker.save_results_samples(task_name=task, samples=samples[task])
