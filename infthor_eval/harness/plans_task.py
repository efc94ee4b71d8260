"""Plans in lm-eval: functions of the task files in `tasks/plans/`, and the adapter of its requests.

A request is a trajectory. lm-eval has no simulator, so only our model class can answer; its
response has the outcome of every plan.
"""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from infthor_eval.errors import UsageError
from infthor_eval.harness.episode_docs import settings_doc, task_request
from infthor_eval.harness.registration import model_takes_references, register
from infthor_eval.harness.requests import Doc
from infthor_eval.plans.evaluation import PlansEvaluation
from infthor_eval.plans.options import PlansOptions
from infthor_eval.plans.records import PlanRecord
from infthor_eval.plans.task import PlanTaskSettings
from infthor_eval.runs import UnitKey, UnitRecord

register()  # see `nieh_task`


def dataset(**config: Any) -> dict[str, Any]:
    """Build the docs of a task, one per trajectory (`custom_dataset` of the task files).

    Args:
        config: settings of the task, and lm-eval's metadata: `data`, and options of the suite.
    """
    from datasets import Dataset

    if not model_takes_references():
        raise UsageError(
            "plans are carried out in a simulator, which infthor-eval's models alone do; use "
            "--model infthor"
        )
    doc = settings_doc("plans", config, PlanTaskSettings, PlansOptions)
    texts: dict[str, list[str]] = {}
    request = task_request(doc, "dataset", PlansOptions, {"max_gen_toks": 1}, 0)
    for unit in PlansEvaluation(request).units:
        texts.setdefault(unit.cluster, []).append(unit.payload.plan)
    docs = [{**doc, "traj_id": name, "plans": plans} for name, plans in texts.items()]
    return {"test": Dataset.from_list(docs)}


def doc_to_text(doc: Doc) -> str:
    """Return the plans, one a line."""
    return "\n".join(doc["plans"])


def doc_to_target(doc: Doc) -> str:
    """Return the expected result: every plan done."""
    return f"{len(doc['plans'])} plans done"


def process_results(_doc: Doc, results: Sequence[str]) -> dict[str, float]:
    """Return the share of completed plans, and the reward of all; see `PlansRequests.response`."""
    plans = json.loads(results[0] or "[]")
    return {
        "success": sum(plan["done"] for plan in plans) / len(plans) if plans else 0.0,
        "reward": sum(plan["reward"] for plan in plans),
    }


class PlansRequests:
    """Plans as requests of lm-eval; see `RequestAdapter`."""

    def prepare(
        self, task: str, docs: Sequence[Doc], generation_kwargs: Mapping[str, Any], seed: int
    ) -> PlansEvaluation:
        """See `RequestAdapter`."""
        return PlansEvaluation(task_request(docs[0], task, PlansOptions, generation_kwargs, seed))

    def doc_id(self, doc: Doc) -> str:
        """Return the name of the trajectory."""
        return str(doc["traj_id"])

    def doc_id_of_unit(self, key: UnitKey, cluster: str) -> str:
        """Return the name of the plan's trajectory."""
        return cluster

    def response(self, records: Sequence[UnitRecord[PlanRecord]]) -> str:
        """Return the outcomes of the plans as JSON, without excluded plans."""
        counted = [record.payload for record in records if record.excluded is None]
        return json.dumps([_outcome(plan) for plan in counted])


def _outcome(plan: PlanRecord) -> dict[str, Any]:
    return {name: getattr(plan, name) for name in ("plan", "done", "reward", "ended")}
