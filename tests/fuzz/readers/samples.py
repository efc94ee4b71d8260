"""Sound inputs: cuts of the bundled set that are read in milliseconds."""

import json
import shutil
from pathlib import Path
from typing import Any

from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.question import Question
from infthor_eval.formats.step_log import read_steps
from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.household.sequence_text import sequence_text

from ...helpers.bundled import BUNDLED

__all__ = ["GOOD", "make_set", "trajectory_document"]

GOOD = "good"  # the trajectory that stays sound
_N_FRAMES = 4


def _bundled() -> Path:
    return BUNDLED / "metadata/bedroom-1-seed7"


def trajectory_document(traj_id: str, n_actions: int = _N_FRAMES - 1) -> dict[str, Any]:
    """Return the JSON of a trajectory with one task of a few actions."""
    document: dict[str, Any] = json.loads((_bundled() / "traj_data.json").read_text())
    plan = document["plan"]
    plan["low_actions"] = [item | {"high_idx": 0} for item in plan["low_actions"][:n_actions]]
    plan["high_pddl"] = plan["high_pddl"][:1]
    document["sub_tasks"], document["images"] = document["sub_tasks"][:1], []
    document["sub_trajs"] = [
        {"sub_traj_idx": 0, "high_pddl_idx": [0, 1], "low_pddl_idx": [0, n_actions]}
    ]
    document["scene"]["object_poses"] = document["scene"]["object_poses"][:4]
    document["long_horizon_task"] = {}
    return document | {"traj_id": traj_id, "object_log": []}


def make_set(folder: Path, n_frames: int = _N_FRAMES) -> Path:
    """Write an NIEH set of two trajectories, "bad" and "good", of some frames, with two questions
    each."""
    for traj_id in ("bad", GOOD):
        place = folder / "metadata" / traj_id
        (place / "img").mkdir(parents=True)
        steps = json.loads((_bundled() / "metadata.json").read_text())[:n_frames]
        for step in steps:
            shutil.copy(_bundled() / "img" / step["img_filename"], place / "img")
        (place / "metadata.json").write_text(json.dumps(steps))
        (place / "traj_data.json").write_text(json.dumps(trajectory_document(traj_id)))
        images = json.loads((_bundled() / "expert_log.json").read_text())["images"][:_N_FRAMES]
        (place / "expert_log.json").write_text(json.dumps({"images": images}))
        shutil.copy(_bundled() / "state_summary.json", place)
        trajectory = next(iter_trajectories(place / "traj_data.json"))
        (place / "traj.txt").write_text(
            sequence_text(trajectory, read_steps(place)[:_N_FRAMES]) + "\n"
        )
    questions = [
        Question(traj_id, text, clues, answers, question_type="presence")
        for traj_id in ("bad", GOOD)
        for text, clues, answers in (
            ("Is there any bed in this room?", (1,), ("yes",)),
            ("Where?", (0, 2), ("Bed", 3)),
        )
    ]
    write_questions(folder / "qa_set.csv", questions)
    (folder / "set.json").write_text(
        json.dumps({"format": 1, "simulator": "embedded", "infthor_eval": "0.1.0"})
    )
    return folder
