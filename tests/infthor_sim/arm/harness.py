"""An arm agent on the bench, and the way to bring its hand to a thing."""

import math
from typing import Any

import numpy as np

from infthor_sim.arm.sweep import moving_boxes, stance
from infthor_sim.simulation import equip

from ..harness import Bench


def arm_bench(scene: str = "kitchen-1", size: int = 40, **init: Any) -> Bench:
    bench = Bench.at(scene, **{"agentMode": "arm", **init}, size=size)
    assert bench.metadata["lastActionSuccess"], bench.metadata["errorMessage"]
    return bench


def wrist(bench: Bench) -> np.ndarray:
    return np.array(list(bench.metadata["arm"]["joints"][-1]["position"].values()))


def xyz(vector: Any) -> dict[str, float]:
    return dict(zip("xyz", map(float, vector), strict=True))


def loose(bench: Bench, object_type: str) -> str:
    """A thing of a type that is not shut in."""
    world = bench.sim.world
    return next(
        o.object_id
        for o in world.objects.values()
        if o.object_type == object_type and not world.is_hidden(o)
    )


def hand_to(bench: Bench, object_id: str) -> None:
    """Stand somewhere before a thing and bring the hand's sphere to it from above."""
    item = bench.sim.world.objects[object_id]
    low, high = item.bounds()
    middle = (low + high) / 2
    target = np.array([middle[0], high[1] + 0.045, middle[2]])
    cells = sorted(bench.sim.world.nav, key=lambda c: abs(math.dist(c, middle[[0, 2]]) - 0.6))
    for x, z in cells[:15]:
        yaw = math.degrees(math.atan2(middle[0] - x, middle[2] - z))
        equip(bench.sim.world, bench.sim.settings.agent_mode)
        bench.teleport(x, z, yaw, 20)
        share = min(max((target[1] + 0.25 - 0.451) / 1.35, 0.0), 1.0)
        if not bench.step("MoveArmBase", y=share)["lastActionSuccess"]:
            continue
        ahead = np.array([math.sin(math.radians(yaw)), 0.0, math.cos(math.radians(yaw))])
        back = target - ahead * 0.07  # the sphere's centre is that far ahead of the wrist
        lift = np.array([0.0, 0.15, 0.0])
        way = [
            bench.step("MoveArm", position=xyz(at), coordinateSpace="world")
            for at in (back + lift, back)
        ]
        near = bench.metadata["arm"]["pickupableObjects"]
        if all(moved["lastActionSuccess"] for moved in way) and object_id in near:
            return
    raise AssertionError(
        f"the hand comes to {object_id} from nowhere: {bench.metadata['errorMessage']}"
    )


def own_boxes(bench: Bench) -> Any:
    world = bench.sim.world
    return moving_boxes(world, world.arm, [stance(world, world.arm)]).flat()
