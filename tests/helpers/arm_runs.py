"""Runs of arms made by hand: no simulator, no policy."""

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from infthor_eval.manipulation.config import ManipulationConfig
from infthor_eval.manipulation.kinds import ManipulationKind
from infthor_eval.manipulation.recorded.runs import ArmRun
from infthor_eval.manipulation.records import ArmRecord
from infthor_eval.runs import RunHeader, UnitRecord

TASKS = {"pickup": "arm_pickup", "put": "arm_put"}
REWARD = 2.0


def make_episode_record(
    trajectory: str,
    index: int,
    kind: str = ManipulationKind.PICKUP,
    *,
    done: bool = True,
    inside: bool = False,
    most: float = REWARD,
    failure: str | None = None,
    excluded: str | None = None,
    task: str | None = None,
) -> UnitRecord[ArmRecord]:
    """The record of an episode; `most` is the most reward there is, `inside` whether the object is
    in the hand's sphere at the start."""
    acted = failure is None and excluded is None
    payload = ArmRecord(
        index=index,
        kind=str(kind),
        instruction="pick up the mug",
        object_id="Mug|1",
        starts_inside=inside and acted,
        start_distance=0.5,
        closest=0.5,
        reward=most if done and acted else 0.0,
        max_reward=most,
        ended=("done" if done else "gave up") if acted else "",
    )
    return UnitRecord(
        task=task or TASKS[kind],
        id=f"{trajectory}/{index:04d}",
        cluster=trajectory,
        fingerprint=f"{trajectory}/{index}",
        payload=payload,
        failure=failure,
        excluded=excluded,
    )


def make_arm_run(
    label: str,
    records: Sequence[UnitRecord[ArmRecord]],
    *,
    radius: float = 0.5,
    simulator: str = "embedded",
    model: Mapping[str, Any] | None = None,
    settings: Mapping[str, Any] | None = None,
) -> ArmRun:
    """A run of these episodes; `settings` are further ones of its tasks."""
    tasks = {
        record.task: {
            "kind": record.payload.kind,
            "radius": radius,
            "instruction": None,
            "trajectories": {item.cluster: f"digest of {item.cluster}" for item in records},
            "config": {"dataset_kwargs": {"kind": record.payload.kind, **(settings or {})}},
            "broken": [],
        }
        for record in records
    }
    identity = {
        "suite": "manipulation",
        "model": dict(model or {"name": label}),
        "simulator": simulator,
        "frames": "shown",
        "tasks": tasks,
    }
    config = msgspec.convert(identity, ManipulationConfig)
    return ArmRun(label, RunHeader(suite="manipulation", name=label, config=config), records)


def make_arm_planner_run(
    records: Sequence[UnitRecord[ArmRecord]], label: str = "planner-arm", **about: Any
) -> ArmRun:
    """The run of the planner, which is the upper bound."""
    return make_arm_run(
        label, records, model={"name": "planner-arm", "baseline": "planner-arm"}, **about
    )
