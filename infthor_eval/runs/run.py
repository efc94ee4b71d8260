"""One run: tasks, a model, a journal, and lm-eval as the host that drives them."""

import json
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import infthor_eval
from infthor_eval.errors import UsageError
from infthor_eval.formats.digests import fingerprint
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.nieh.contexts import context_named
from infthor_eval.nieh.work import Work, find_set, find_work, open_set
from infthor_eval.runs.budget import Budget, budget_of
from infthor_eval.runs.catalog import Catalog
from infthor_eval.runs.journal import Journal, Observer, UnitRecord
from model_adapters import Bound, Model, load

__all__ = ["Plan", "RunOutcome", "RunRequest", "TaskPlan", "execute", "plan"]

# Bounds read no frames; contexts that are measured in tokens are cut for them as for Qwen2.5-VL (published count).
_BOUND_TOKENS_PER_FRAME = 121


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
        k_tokens: tokens of a kilo-token in contexts of a given size; None takes each context's published value.
        retriever: CLIP model of contexts that retrieve frames, a hub id or a folder; None takes the published one.
        retriever_revision: branch, tag or commit of it on the hub; None is the default branch.
    """

    model: str
    tasks: tuple[str, ...]
    output: Path
    data: Path | None = None
    model_options: Mapping[str, str] = field(default_factory=dict)
    limit: int | None = None
    seed: int = 0
    k_tokens: int | None = None
    retriever: str | None = None
    retriever_revision: str | None = None


@dataclass(frozen=True)
class TaskPlan:
    """One task: its file's settings, and what it asks.

    Attributes:
        name: the lm-eval task.
        config: the task file's settings.
        work: what is asked and what is left out; None as long as that depends on a model which is not loaded yet.
    """

    name: str
    config: Mapping[str, Any]
    work: Work | None

    @property
    def resolved(self) -> Work:
        """The work, once it is known."""
        if self.work is None:
            raise ValueError(f"what {self.name} asks depends on the model; load it first")
        return self.work


@dataclass(frozen=True)
class Plan:
    """A request whose names, files and questions have been found to be in order.

    Attributes:
        request: what was asked for.
        tasks: what it comes to.
        tokens_per_frame: the model's tokens of one frame, where a task's frames depend on it.
    """

    request: RunRequest
    tasks: list[TaskPlan]
    tokens_per_frame: int | None = None

    @property
    def n_units(self) -> int:
        """Questions that will be asked, over all tasks and variants."""
        limit = self.request.limit
        return sum(min(limit or len(task.resolved.cases), len(task.resolved.cases)) for task in self.tasks)


@dataclass(frozen=True)
class RunOutcome:
    """A finished run: its folder, who it was, and every record."""

    folder: Path
    identity: dict[str, Any]
    records: list[UnitRecord]


def plan(request: RunRequest) -> Plan:
    """Check a request before anything expensive is loaded.

    Raises:
        UsageError: an unknown task, a task without its data or with nothing that can be asked, a retriever that cannot
            be loaded, or an option that none of the tasks looks at.
        DataError: the set is not what the format says.
    """
    open_set.cache_clear()  # its files may have changed since an earlier run of this process
    catalog = Catalog.packaged()
    tasks = []
    for name in catalog.expand(request.tasks):
        config = catalog.tasks[name]
        settings = _metadata(request) | config["dataset_kwargs"]
        if context_named(settings["context"]).needs_model:
            work = None
            find_set(**settings)
        else:
            work = find_work(settings)
        tasks.append(TaskPlan(name, config, work))
    _refuse_nothing(tasks)
    _refuse_unused(request, tasks)
    return Plan(request, tasks)


def execute(ready: Plan, begin: Callable[[Plan, list[Budget]], Observer]) -> RunOutcome:
    """Load the model, ask what the journal does not hold yet, and write the run's files.

    The folder `<output>/<model>/<tasks>-<identity>/` holds `journal.jsonl` and lm-eval's results and samples.

    Args:
        ready: what `plan` found.
        begin: called before the first token is computed, with all that will be asked and what it costs in tokens
            (nothing for a bound); what it returns is told of each unit that is done.

    Raises:
        UsageError: a wrong model name or option, another process at the same run, or nothing that can be asked.
        ModelError: the model cannot be loaded.
    """
    request = ready.request
    model = load(request.model, request.model_options, request.seed)
    try:
        ready = _resolved(ready, model)
        if isinstance(model, Bound):
            model.study([question for task in ready.tasks for question in task.resolved.data.questions])
        identity = _identity(ready, model)
        folder = request.output / request.model / f"{'+'.join(request.tasks)[:80]}-{fingerprint(identity)}"
        with Journal(folder / "journal.jsonl", identity) as journal:
            _evaluate(ready, model, journal, begin(ready, _budgets(ready, model)), folder / "lm_eval")
            return RunOutcome(folder, identity, journal.records)
    finally:
        if isinstance(model, Model):
            model.close()


def _metadata(request: RunRequest, tokens_per_frame: int | None = None) -> dict[str, Any]:
    """What this run tells its tasks beside their files' own settings."""
    ours = {
        "data": str(request.data) if request.data else None,
        "k_tokens": request.k_tokens,
        "retriever": request.retriever,
        "retriever_revision": request.retriever_revision,
        "tokens_per_frame": tokens_per_frame,
    }
    return {"seed": request.seed} | {key: value for key, value in ours.items() if value is not None}


def _refuse_nothing(tasks: Sequence[TaskPlan]) -> None:
    """A task of several may have nothing to ask (no window so large fits); all of them may not."""
    if any(task.work is None or task.work.cases for task in tasks):
        return
    reasons = {item.reason for task in tasks for item in task.resolved.left_out}
    said = "; ".join(sorted(reasons)[:3]) or "its files are empty"
    raise UsageError(f"no question of {tasks[0].resolved.data.root} can be asked ({said})")


def _refuse_unused(request: RunRequest, tasks: Sequence[TaskPlan]) -> None:
    """A kilo-token that no context is measured in would only give the run another identity; a retriever mislead."""
    named = ", ".join(request.tasks)
    measured = any(context_named(task.config["dataset_kwargs"]["context"]).needs_model for task in tasks)
    if request.k_tokens is not None and not measured:
        raise UsageError(
            f"--k-tokens {request.k_tokens}: no context of {named} has a size in kilo-tokens; "
            "leave it out, or ask nieh_haystack or nieh_truncate_head"
        )
    retrieves = any(task.work is not None and "retriever" in task.work.sources for task in tasks)
    if (request.retriever or request.retriever_revision) and not retrieves:
        raise UsageError(
            f"--retriever: no context of {named} retrieves frames; "
            "leave it out, or ask nieh_clip_retrieval or nieh_memory_frames"
        )


def _resolved(ready: Plan, model: Model | Bound) -> Plan:
    """The plan with the work that depends on the model."""
    waiting = [task for task in ready.tasks if task.work is None]
    if not waiting:
        return ready
    tokens = _tokens_per_frame(model, find_set(**_metadata(ready.request) | waiting[0].config["dataset_kwargs"]))
    tasks = []
    for task in ready.tasks:
        settings = _metadata(ready.request, tokens) | task.config["dataset_kwargs"]
        tasks.append(replace(task, work=task.work or find_work(settings)))
    _refuse_nothing(tasks)
    return Plan(ready.request, tasks, tokens)


def _budgets(ready: Plan, model: Model | Bound) -> list[Budget]:
    if isinstance(model, Bound):
        return []
    return [
        budget_of(
            task.name,
            task.config["dataset_kwargs"]["context"],
            task.resolved,
            model,
            task.config["generation_kwargs"]["max_gen_toks"],
        )
        for task in ready.tasks
    ]


def _tokens_per_frame(model: Model | Bound, data: NiehSet) -> int:
    if isinstance(model, Bound):
        return _BOUND_TOKENS_PER_FRAME
    return model.tokens_per_frame(data.frames(data.questions[0].traj_id)[0])


def _identity(ready: Plan, model: Model | Bound) -> dict[str, Any]:
    request = ready.request
    identity = {
        "infthor_eval": infthor_eval.__version__,
        "model": {"name": model.name, **model.identity()},
        "tasks": {task.name: _task_identity(task) for task in ready.tasks},
        "limit": request.limit,
        "seed": request.seed,
        "k_tokens": request.k_tokens,
    }
    # As it is read back from the journal: tuples are lists, keys are strings.
    return dict(json.loads(json.dumps(identity)))


def _task_identity(task: TaskPlan) -> dict[str, Any]:
    work = task.resolved
    left_out = [{"question_id": i.question.id, "variant": i.variant, "reason": i.reason} for i in work.left_out]
    return {
        "config": dict(task.config),
        "data": work.data.fingerprint,
        "simulator": work.data.simulator,
        "sources": work.sources,
        "n_cases": len(work.cases),
        "left_out": left_out,
    }


def _evaluate(ready: Plan, model: Model | Bound, journal: Journal, observe: Observer, output: Path) -> None:
    """Have lm-eval drive the model through the tasks, and write its own files."""
    import lm_eval.models  # noqa: F401 - before anything is registered, or the built-in models vanish (0.4.13)
    from datasets.utils.logging import disable_progress_bar
    from lm_eval import simple_evaluate
    from lm_eval.loggers import EvaluationTracker
    from lm_eval.tasks import TaskManager

    from infthor_eval.runs.lm import JournaledLM

    disable_progress_bar()
    logging.getLogger("lm_eval").setLevel(logging.ERROR)
    tracker = EvaluationTracker(output_path=str(output))
    results = simple_evaluate(
        model=JournaledLM(model, journal, observe),
        tasks=[task.name for task in ready.tasks if task.resolved.cases],
        task_manager=TaskManager(
            include_path=str(Catalog.packaged().folder),
            include_defaults=False,
            metadata={**_metadata(ready.request, ready.tokens_per_frame), "pixels": False},
        ),
        limit=ready.request.limit,
        bootstrap_iters=0,
        evaluation_tracker=tracker,
    )
    samples = results.pop("samples")
    tracker.save_results_aggregated(results=results, samples=samples)
    for name in sorted(samples):
        tracker.save_results_samples(task_name=name, samples=samples[name])
