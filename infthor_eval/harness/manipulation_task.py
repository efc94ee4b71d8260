"""The functions behind the task files in `tasks/manipulation/`, called by lm-eval: an episode is one request.

lm-eval has no simulator and no policies, so our model class alone can answer, with a policy as its adapter.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from infthor_eval.errors import UsageError
from infthor_eval.harness.episode_docs import about_run
from infthor_eval.harness.registration import model_takes_references, register
from infthor_eval.manipulation.evaluation import ManipulationEvaluation
from infthor_eval.manipulation.options import ManipulationOptions
from infthor_eval.manipulation.records import ArmRecord
from infthor_eval.manipulation.task import ArmTaskSettings
from infthor_eval.runs import TaskFile, TaskRequest, UnitRecord

__all__ = ["arm_evaluation", "arm_response", "dataset", "doc_to_target", "doc_to_text", "process_results"]

register()  # see `nieh_task`

Doc = dict[str, Any]


def dataset(**config: Any) -> dict[str, Any]:
    """The docs of a task, one per episode (`custom_dataset` of the task files).

    Args:
        config: the task's settings, and of what lm-eval hands over as metadata: `data`, and the suite's options.

    Raises:
        UsageError: the model is not ours, or there are no trajectories.
        DataError: none of them can be read.
    """
    from datasets import Dataset

    if not model_takes_references():
        raise UsageError(
            "arms are driven in a simulator, which infthor-eval's policies alone do; use --model infthor"
            " --model_args adapter=openvla"
        )
    about = about_run(config, ArmTaskSettings, ManipulationOptions)
    units = arm_evaluation(about, "dataset", 0).units
    return {
        "test": Dataset.from_list([
            {**about, "arm_episode": unit.key.id, "instruction": unit.payload.instruction} for unit in units
        ])
    }  # fmt: skip


def doc_to_text(doc: Doc) -> str:
    """What a policy is told."""
    return str(doc["instruction"])


def doc_to_target(doc: Doc) -> str:
    """That it is done."""
    return f"{doc['arm_episode']}: done"


def process_results(_doc: Doc, results: Sequence[str]) -> dict[str, float]:
    """Whether the episode was a success, and what it earned; see `arm_response`."""
    found = json.loads(results[0] or "{}")
    return {"success": float(found.get("done", False)), "reward": float(found.get("reward", 0.0))}


def arm_evaluation(doc: Doc, task: str, seed: int) -> ManipulationEvaluation:
    """The suite set up for the task of a doc.

    Args:
        doc: any of the task's.
        task: its name.
        seed: of the run.
    """
    file = TaskFile(task, "manipulation", Path(task), {"dataset_kwargs": json.loads(doc["settings"])})
    data = Path(doc["data"]) if doc["data"] else None
    return ManipulationEvaluation(
        TaskRequest([file], ManipulationOptions(**json.loads(doc["options"])), data, None, seed)
    )


def arm_response(record: UnitRecord[ArmRecord]) -> str:
    """What came of an episode, as JSON; one that does not count is told as none."""
    payload = record.payload
    if record.excluded is not None:
        return json.dumps({"excluded": record.excluded})
    return json.dumps({"done": payload.done, "reward": payload.reward, "ended": payload.ended})
