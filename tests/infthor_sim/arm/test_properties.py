"""Whatever an arm agent does, its hand is in nothing solid, and the world stays consistent."""

from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from infthor_sim.actions.arm_motion import obstacles
from infthor_sim.geometry import euler_matrix

from ..harness import Bench
from ..schema import check
from .harness import arm_bench, own_boxes

GRID = np.stack(np.meshgrid(*[np.linspace(-1, 1, 5)] * 3), axis=-1).reshape(-1, 3)
NUMBER = st.floats(-1.2, 1.2).map(lambda value: round(value, 3))
VECTOR = st.fixed_dictionaries({"x": NUMBER, "y": NUMBER, "z": NUMBER})
BACK = st.fixed_dictionaries({}, optional={"returnToStart": st.booleans()})
DEGREES = st.floats(-200, 200).map(lambda value: round(value, 2))


def call(action: str, **arguments: Any) -> Any:
    return st.tuples(
        st.just(action),
        st.fixed_dictionaries(arguments),
        BACK if action not in NO_RETURN else st.just({}),
    )


NO_RETURN = {"PickupObject", "ReleaseObject", "SetHandSphereRadius", "LookDown"}
STEP = st.one_of(
    call("MoveArm", position=VECTOR, coordinateSpace=st.sampled_from(["armBase", "wrist"])),
    call(
        "MoveArmRelative",
        offset=VECTOR,
        coordinateSpace=st.sampled_from(["armBase", "wrist", "world"]),
    ),
    call("MoveArmBase", y=st.floats(0, 1)),
    call("MoveArmBaseUp", distance=NUMBER),
    call("RotateWristRelative", pitch=DEGREES, yaw=DEGREES, roll=DEGREES),
    call("RotateElbowRelative", degrees=DEGREES),
    call("MoveAgent", ahead=NUMBER.filter(bool), right=NUMBER),
    call("RotateAgent", degrees=DEGREES),
    call("SetHandSphereRadius", radius=st.floats(0.04, 0.5)),
    call("PickupObject"),
    call("ReleaseObject"),
)
SCENES = st.sampled_from(["kitchen-1", "kitchen-4", "living-room-1", "bedroom-1", "bathroom-1"])
PROPERTY = settings(max_examples=15)


def deepest(bench: Bench, thing: int) -> tuple[float, str]:
    """How deep points of a box of the arm are in something solid, metres, and in what."""
    box, solids = own_boxes(bench)[thing : thing + 1], obstacles(bench.sim)
    points = box.center[0] + (GRID * box.half[0]) @ box.axes[0]
    local = np.abs(
        np.einsum("nij,pnj->pni", solids.boxes.axes, points[:, None] - solids.boxes.center)
    )
    depth = (solids.boxes.half - local).min(axis=2).max(axis=0)
    return float(depth.max()), solids.names[solids.owner[depth.argmax()]]


def at_rest_in_the_open(scene: str) -> Bench:
    """The agent with its arm raised, at a place where the arm is in nothing."""
    bench = arm_bench(scene)
    world = bench.sim.world
    world.arm.change(world.arm.rig.with_lift(world.arm.pose, 0.6))
    for x, z in sorted(world.nav, key=lambda c: -world.nav.count_free_ahead(*c, 0.0)):
        world.agent.position, world.agent.yaw = np.array([x, world.agent.position[1], z]), 0.0
        if all(deepest(bench, part)[0] < 0 for part in range(4)):
            return bench
    raise AssertionError(f"{scene} has no room for the arm")


@PROPERTY
@given(scene=SCENES, steps=st.lists(STEP, min_size=3, max_size=15))
def test_the_hand_never_enters_a_box(scene, steps):
    bench = at_rest_in_the_open(scene)
    for action, arguments, back in steps:
        bench.step(action, **arguments, **back)
        for part in range(4):
            depth, name = deepest(bench, part)
            assert depth < 0.002, f"after {action} part {part} is {depth:.4f} m in {name}"


@PROPERTY
@given(scene=SCENES, steps=st.lists(STEP, min_size=3, max_size=15))
def test_held_things_keep_their_offset_and_the_world_is_consistent(scene, steps):
    bench = at_rest_in_the_open(scene)
    offsets: dict[str, Any] = {}
    for action, arguments, back in [
        ("SetHandSphereRadius", {"radius": 0.5}, {}),
        ("PickupObject", {}, {}),
        *steps,
    ]:
        metadata = bench.step(action, **arguments, **back)
        check(metadata)
        world = bench.sim.world
        held = metadata["arm"]["heldObjects"]
        assert held == list(world.arm.held)
        assert sorted(held) == sorted(o["objectId"] for o in metadata["objects"] if o["isPickedUp"])
        frame = world.arm.wrist(world.agent)
        now = {
            key: (
                frame.local(world.objects[key].position),
                frame.turn.T @ euler_matrix(world.objects[key].rotation),
            )
            for key in (*held, *world.arm.held_contents)
        }
        for key in now.keys() & offsets.keys():
            if key in held or action != "ReleaseObject":
                np.testing.assert_allclose(now[key][0], offsets[key][0], atol=1e-6)
                np.testing.assert_allclose(now[key][1], offsets[key][1], atol=1e-6)
        offsets = now
        if not metadata["lastActionSuccess"]:
            assert metadata["errorMessage"]
        inside = {
            c: o["objectId"] for o in metadata["objects"] for c in o["receptacleObjectIds"] or ()
        }
        for item in metadata["objects"]:
            parent = [inside[item["objectId"]]] if item["objectId"] in inside else None
            assert item["parentReceptacles"] == parent


@PROPERTY
@given(scene=SCENES, steps=st.lists(STEP, min_size=3, max_size=8))
def test_the_same_actions_give_the_same_bytes(scene, steps):
    replies = []
    for _ in range(2):
        bench = arm_bench(scene)
        replies.append(
            [
                (bench.step(action, **arguments, **back), bench.frames)[1]
                for action, arguments, back in steps
            ]
        )
    assert replies[0] == replies[1]
