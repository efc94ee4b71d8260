"""The functions behind the task files in `tasks/plans/`, called by lm-eval: an episode is one request.

lm-eval has no simulator, so our model class alone can answer. It goes through the trajectory that a doc names, and its
response tells what came of every plan (`episode_response`).
"""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from infthor_eval.errors import UsageError
from infthor_eval.harness.episode_docs import about_run
from infthor_eval.harness.registration import model_takes_references, register
from infthor_eval.plans.evaluation import PlansEvaluation
from infthor_eval.plans.options import PlansOptions
from infthor_eval.plans.records import PlanRecord
from infthor_eval.plans.task import PlanTaskSettings
from infthor_eval.runs import TaskFile, TaskRequest, UnitRecord

__all__ = ["dataset", "doc_to_target", "doc_to_text", "episode_response", "evaluation_around", "process_results"]

register()  # see `nieh_task`

Doc = dict[str, Any]


def dataset(**config: Any) -> dict[str, Any]:
    """The docs of a task, one per trajectory (`custom_dataset` of the task files).

    Args:
        config: the task's settings, and of what lm-eval hands over as metadata: `data`, and the suite's options.

    Raises:
        UsageError: the model is not ours, or there are no trajectories.
        DataError: none of them can be read.
    """
    from datasets import Dataset

    if not model_takes_references():
        raise UsageError(
            "plans are carried out in a simulator, which infthor-eval's models alone do; use --model infthor"
        )
    about = about_run(config, PlanTaskSettings, PlansOptions)
    evaluation = evaluation_around({**about, "traj_id": ""}, "dataset", {"max_gen_toks": 1}, 0)
    texts: dict[str, list[str]] = {}
    for unit in evaluation.units:
        texts.setdefault(unit.cluster, []).append(unit.payload.plan)
    return {"test": Dataset.from_list([{**about, "traj_id": name, "plans": plans} for name, plans in texts.items()])}


def doc_to_text(doc: Doc) -> str:
    """What is to be done, a plan a line."""
    return "\n".join(doc["plans"])


def doc_to_target(doc: Doc) -> str:
    """That every plan is carried out."""
    return f"{len(doc['plans'])} plans done"


def process_results(_doc: Doc, results: Sequence[str]) -> dict[str, float]:
    """Share of the plans carried out, and the reward of all of them together; see `episode_response`."""
    plans = json.loads(results[0] or "[]")
    return {
        "success": sum(plan["done"] for plan in plans) / len(plans) if plans else 0.0,
        "reward": sum(plan["reward"] for plan in plans),
    }


def evaluation_around(doc: Doc, task: str, generation_kwargs: dict[str, Any], seed: int) -> PlansEvaluation:
    """The suite set up for the task of a doc.

    Args:
        doc: any of the task's.
        task: its name.
        generation_kwargs: as lm-eval hands them over.
        seed: of the run.
    """
    settings = {"dataset_kwargs": json.loads(doc["settings"]), "generation_kwargs": generation_kwargs}
    file = TaskFile(task, "plans", Path(task), settings)
    data = Path(doc["data"]) if doc["data"] else None
    return PlansEvaluation(TaskRequest([file], PlansOptions(**json.loads(doc["options"])), data, None, seed))


def episode_response(records: Iterable[UnitRecord[PlanRecord]]) -> str:
    """What came of the plans of a trajectory, as JSON; those that do not count are left out."""
    plans = [
        {
            "plan": item.payload.plan,
            "done": item.payload.done,
            "reward": item.payload.reward,
            "ended": item.payload.ended,
        }
        for item in records
        if item.excluded is None
    ]
    return json.dumps(plans)
