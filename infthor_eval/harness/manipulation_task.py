"""Manipulation in lm-eval: functions of `tasks/manipulation/`, and the adapter of its requests.

A request is an episode. lm-eval has no simulator and no policies, so only our model class can
answer, with a policy as its adapter.
"""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from infthor_eval.errors import UsageError
from infthor_eval.harness.episode_docs import settings_doc, task_request
from infthor_eval.harness.registration import model_takes_references, register
from infthor_eval.harness.requests import Doc
from infthor_eval.manipulation.evaluation import ManipulationEvaluation
from infthor_eval.manipulation.options import ManipulationOptions
from infthor_eval.manipulation.records import ArmRecord
from infthor_eval.manipulation.task import ArmTaskSettings
from infthor_eval.runs import UnitKey, UnitRecord

register()  # see `nieh_task`


def dataset(**config: Any) -> dict[str, Any]:
    """Build the docs of a task, one per episode (`custom_dataset` of the task files).

    Args:
        config: settings of the task, and lm-eval's metadata: `data`, and options of the suite.
    """
    from datasets import Dataset

    if not model_takes_references():
        raise UsageError(
            "arms are driven in a simulator, which infthor-eval's policies alone do; use --model "
            "infthor --model_args adapter=openvla"
        )
    doc = settings_doc("manipulation", config, ArmTaskSettings, ManipulationOptions)
    units = ManipulationEvaluation(task_request(doc, "dataset", ManipulationOptions, {}, 0)).units
    docs = []
    for unit in units:
        episode = {"arm_episode": unit.key.id, "instruction": unit.payload.instruction}
        docs.append(doc | episode)
    return {"test": Dataset.from_list(docs)}


def doc_to_text(doc: Doc) -> str:
    """Return the instruction to the policy."""
    return str(doc["instruction"])


def doc_to_target(doc: Doc) -> str:
    """Return the expected result: the episode done."""
    return f"{doc['arm_episode']}: done"


def process_results(_doc: Doc, results: Sequence[str]) -> dict[str, float]:
    """Return success and reward of the episode; see `ManipulationRequests.response`."""
    outcome = json.loads(results[0] or "{}")
    return {
        "success": float(outcome.get("done", False)),
        "reward": float(outcome.get("reward", 0.0)),
    }


class ManipulationRequests:
    """Manipulation as requests of lm-eval; see `RequestAdapter`."""

    def prepare(
        self, task: str, docs: Sequence[Doc], generation_kwargs: Mapping[str, Any], seed: int
    ) -> ManipulationEvaluation:
        """See `RequestAdapter`."""
        return ManipulationEvaluation(
            task_request(docs[0], task, ManipulationOptions, generation_kwargs, seed)
        )

    def doc_id(self, doc: Doc) -> str:
        """Return the id of the episode."""
        return str(doc["arm_episode"])

    def doc_id_of_unit(self, key: UnitKey, cluster: str) -> str:
        """Return the id of the episode."""
        return key.id

    def response(self, records: Sequence[UnitRecord[ArmRecord]]) -> str:
        """Return the outcome of the episode as JSON; of an excluded one, the reason."""
        (record,) = records
        payload = record.payload
        if record.excluded is not None:
            return json.dumps({"excluded": record.excluded})
        return json.dumps({"done": payload.done, "reward": payload.reward, "ended": payload.ended})
