"""Episodes in the simulator: how they begin, what counts as success, and what baselines make of
them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from infthor_eval.episodes.records import InfeasibleError
from infthor_eval.household.containment import is_in
from infthor_eval.manipulation.actors import BASELINES
from infthor_eval.manipulation.conversion import Conversion
from infthor_eval.manipulation.environment import ArmEnvironment, Grasp
from infthor_eval.manipulation.geometry import distance_to, middle_of, point_of
from infthor_eval.manipulation.kinds import ManipulationKind
from infthor_eval.manipulation.records import ArmEnded
from infthor_eval.thor.frames import NoFrames
from model_adapters import ArmDelta

# Pick-ups: out of the sphere's reach; in the sphere at the start; the book once more.
BOOK, PEN, AGAIN = (7, 100, 27)
ON_TABLE, ON_BED, INTO_DRAWER = 106, 53, 23  # puts of the pen, and of the book


@pytest.fixture(scope="module")
def room(arena):
    """A bedroom in which things are picked up and put five times."""
    return arena("bedroom-2-seed7", 99)


def actor(name):
    return BASELINES[name](0).arm_actor()


def play_all(room, name, kind, **settings):
    """The episodes of a kind, run by a baseline."""
    return [room.play(actor(name), episode.index, **settings) for episode in room.of(kind)]


def gripper(value):
    return ArmDelta((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), value)


# -- baselines


def test_who_stands_still_gets_just_what_lies_in_the_sphere_at_the_start(room):
    played = play_all(room, "still", ManipulationKind.PICKUP)
    for record in played:
        assert record.done == record.starts_inside == (record.start_distance <= 0.5)
    # The book, a ball and a pen before it.
    assert [record.index for record in played if record.done] == [51, 67, 100]
    assert all(len(record.steps) == 1 for record in played)
    assert {record.ended for record in played} == {"done", "gave up"}
    (refused,) = room.play(actor("still"), BOOK).steps[0].refusals
    assert "refused" not in refused  # the simulator's own words


def test_the_planner_picks_up_and_puts_all(room):
    picked = play_all(room, "planner-arm", ManipulationKind.PICKUP)
    assert [record.ended for record in picked] == ["done"] * 5
    assert all(record.reward == record.max_reward == 2 for record in picked)
    put = play_all(room, "planner-arm", ManipulationKind.PUT)
    assert [record.ended for record in put] == ["done"] * 5


def test_the_planner_puts_into_open_drawers(arena):
    put = play_all(arena("kitchen-2-seed4", 99), "planner-arm", ManipulationKind.PUT)
    assert [record.ended for record in put] == ["done"] * 3
    assert all(len(record.steps) < 10 for record in put)


def test_a_larger_sphere_takes_no_success_from_the_planner(room):
    radii = (0.06, 0.1, 0.2, 0.35, 0.5)
    played = [play_all(room, "planner-arm", ManipulationKind.PICKUP, radius=it) for it in radii]
    rates = [sum(record.done for record in records) for records in played]
    assert rates == sorted(rates)
    assert rates[0] > 0 and rates[-1] == 5


def test_equal_seeds_move_alike_and_other_seeds_and_episodes_do_not(room):
    def moved(index, seed):
        steps = room.play(actor("random-arm"), index, seed, max_steps=4).steps
        return [step.delta for step in steps]

    first = moved(AGAIN, 7)
    assert len(first) == 4 and len(set(first)) == 4
    assert moved(BOOK, 7) != first
    assert moved(AGAIN, 7) == first
    assert moved(AGAIN, 8) != first


def test_a_random_arm_keeps_within_the_longest_step_and_ten_degrees(room):
    steps = room.play(actor("random-arm"), AGAIN, max_step=0.03, max_steps=20).steps
    moves = [step.delta[:3] for step in steps]
    assert 0.015 < max(abs(part) for move in moves for part in move) <= 0.03
    assert 0.08 < max(abs(part) for step in steps for part in step.delta[3:6]) <= math.radians(10)
    assert {step.delta[6] < 0.5 for step in steps} == {True, False}


# -- how an episode begins


@pytest.mark.parametrize("index", [BOOK, PEN, ON_TABLE, ON_BED])
def test_an_episode_begins_in_the_experts_pose_with_the_arm_at_rest(room, index):
    _, begun = room.begin(index)
    wanted, agent = room.states.starts[index].view.agent, begun.view.agent
    assert (agent.position.x, agent.position.z) == (wanted.position.x, wanted.position.z)
    assert (agent.rotation, agent.horizon) == (wanted.rotation, wanted.horizon)
    arm = begun.view.arm
    assert arm.sphere_radius == 0.5
    start = room.states.starts[index]
    assert list(arm.held) == ([start.object_id] if start.receptacle_id else [])
    level = math.hypot(arm.wrist.x - agent.position.x, arm.wrist.z - agent.position.z)
    assert level == pytest.approx(0.4, abs=1e-3)  # ahead, as at rest


@pytest.mark.parametrize("index", [ON_TABLE, ON_BED, INTO_DRAWER])
def test_of_a_put_the_wrist_is_as_high_as_the_experts_hand(room, index):
    _, begun = room.begin(index)
    start = room.states.starts[index]
    hand = start.view.objects[start.object_id].position.y
    # The range of 1.35 m, halved eight times.
    assert begun.view.arm.wrist.y == pytest.approx(hand, abs=0.01)


def test_an_episode_begins_alike_whatever_was_done_before(room):
    _, fresh = room.begin(PEN)
    room.play(actor("random-arm"), ON_TABLE)
    room.play(actor("planner-arm"), ON_BED)
    _, again = room.begin(PEN)
    assert again.view.objects == fresh.view.objects
    assert again.view.arm == fresh.view.arm and again.view.agent == fresh.view.agent
    assert again.distance == fresh.distance


@pytest.mark.parametrize("index", [ON_TABLE, ON_BED, INTO_DRAWER])
def test_what_is_held_before_the_palm_is_nearer_to_it_than_in_the_middle(room, index):
    def distance(at_palm):
        _, begun = room.begin(index, Grasp(at_palm=at_palm))
        held = begun.view.objects[room.states.starts[index].object_id]
        return math.dist(middle_of(held), point_of(begun.view.arm.wrist))

    # The middle is radius and palm away.
    assert distance(at_palm=True) < distance(at_palm=False) <= 0.51 + 0.01


def test_the_agent_needs_an_arm(room, pool):
    with pool.one(image=False, instances=False) as without:
        environment = ArmEnvironment(room.trajectory, without)
        with pytest.raises(
            InfeasibleError, match="the episode cannot be begun: SetHandSphereRadius: "
        ):
            environment.reset(
                room.episodes[BOOK], room.states.starts[BOOK], Conversion(), Grasp(), NoFrames()
            )  # fmt: skip


def test_no_step_without_an_episode(room):
    environment = ArmEnvironment(room.trajectory, room.simulator)
    with pytest.raises(RuntimeError, match="no episode is under way"):
        environment.step(gripper(1.0))
    environment, _ = room.begin(PEN)
    assert environment.step(gripper(0.0)).ended == ArmEnded.DONE
    with pytest.raises(RuntimeError, match="no episode is under way"):
        environment.step(gripper(0.0))


# -- the gripper


@pytest.mark.parametrize(("threshold", "value", "taken"), [
    (0.5, 0.49, True), (0.5, 0.5, False), (0.7, 0.69, True), (0.7, 0.7, False), (0.2, 0.3, False),
])  # fmt: skip
def test_below_the_threshold_the_hand_closes(room, threshold, value, taken):
    environment, begun = room.begin(PEN, Grasp(threshold=threshold))
    outcome = environment.step(gripper(value))
    target = environment.start.object_id
    assert environment.starts_inside and target in begun.view.arm.pickupable
    assert (outcome.ended == ArmEnded.DONE) == taken == (target in outcome.view.inventory)
    assert [call["action"] for call in outcome.calls] == ["PickupObject"] * taken


@pytest.mark.parametrize(("value", "released"), [(0.49, False), (0.5, True)])
def test_at_the_threshold_it_opens(room, value, released):
    environment, _ = room.begin(ON_BED)
    outcome = environment.step(gripper(value))
    assert (outcome.ended is not None) == released == (outcome.view.inventory == ())
    assert [call["action"] for call in outcome.calls] == ["ReleaseObject"] * released


def test_a_hand_that_closes_around_nothing_does_nothing(room):
    environment, _ = room.begin(BOOK)
    outcome = environment.step(gripper(0.0))
    assert (outcome.ended, outcome.calls, outcome.refusals) == (None, (), ())


def test_a_hand_takes_the_target_alone_or_all_that_is_in_the_sphere(room):
    environment, begun = room.begin(PEN)
    target, near = environment.start.object_id, set(begun.view.arm.pickupable)
    assert len(near) > 1
    assert environment.step(gripper(0.0)).view.inventory == (target,)
    environment, _ = room.begin(PEN, Grasp(takes_all=True))
    outcome = environment.step(gripper(0.0))
    assert set(outcome.view.inventory) == near
    assert outcome.ended == ArmEnded.DONE


def test_other_things_in_the_hand_are_no_success(room):
    """The sphere holds something, but not the target."""
    n_others = 0
    for episode in room.of(ManipulationKind.PICKUP):
        environment, begun = room.begin(episode.index, Grasp(takes_all=True))
        if environment.starts_inside or not begun.view.arm.pickupable:
            continue
        outcome = environment.step(gripper(0.0))
        assert outcome.view.inventory and outcome.ended is None
        assert environment.step(gripper(1.0)).view.inventory == ()  # and it lets go of them again
        n_others += 1
    assert n_others


# -- what counts


def over(environment, item, aside=0.0):
    """Calls that bring what is held over an object's middle, or beside it."""
    held = environment.view.objects[environment.start.object_id]
    wrist = environment.view.arm.wrist
    goal, now = middle_of(item), middle_of(held)
    top = goal[1] + item.axis_aligned_bounding_box.size.y / 2
    place = {
        "x": goal[0] + wrist.x - now[0] + aside,
        "y": top + 0.1 + held.axis_aligned_bounding_box.size.y / 2 + wrist.y - now[1],
        "z": goal[2] + wrist.z - now[2],
    }
    where = {"position": place, "coordinateSpace": "world"}
    return {"action": "MoveArm", **where, "returnToStart": False}


def test_released_over_the_receptacle_counts(room):
    environment, _ = room.begin(ON_TABLE)
    target, box = environment.start.object_id, environment.start.receptacle_id
    moved = environment.step([over(environment, environment.view.objects[box])])
    assert moved.ended is None  # over it is not in it
    outcome = environment.step([{"action": "ReleaseObject"}])
    assert outcome.ended == ArmEnded.DONE
    assert is_in(target, box, outcome.view)
    # It fell.
    assert middle_of(outcome.view.objects[target])[1] < middle_of(moved.view.objects[target])[1]


def test_released_elsewhere_does_not_count(room):
    environment, _ = room.begin(ON_TABLE)
    target, box = environment.start.object_id, environment.start.receptacle_id
    outcome = environment.step(gripper(1.0))
    assert outcome.ended == ArmEnded.ELSEWHERE
    assert not is_in(target, box, outcome.view)
    record = room.play(actor("still"), ON_TABLE)
    assert (record.ended, record.reward, record.done) == ("released elsewhere", 0, False)


def test_the_last_step_that_there_is_counts_and_one_fewer_is_too_few(room):
    whole = room.play(actor("planner-arm"), BOOK)
    n = len(whole.steps)
    assert n > 1
    assert room.play(actor("planner-arm"), BOOK, max_steps=n) == whole
    short = room.play(actor("planner-arm"), BOOK, max_steps=n - 1)
    assert (short.ended, short.reward, len(short.steps)) == ("step limit", 0, n - 1)
    assert short.steps == whole.steps[:-1]


def test_distances_are_from_the_spheres_centre_to_the_targets_box(room):
    for index in (BOOK, ON_TABLE):
        environment, begun = room.begin(index)
        target = environment.start.receptacle_id or environment.start.object_id
        for outcome in (begun, environment.step(ArmDelta((0.05, 0, 0.02), (0, 0.1, 0), 0.49))):
            item, center = outcome.view.objects[target], point_of(outcome.view.arm.sphere_center)
            box = item.axis_aligned_bounding_box
            middle, half = np.array(point_of(box.center)), np.array(point_of(box.size)) / 2
            nearest = np.clip(center, middle - half, middle + half)
            assert outcome.distance == pytest.approx(math.dist(center, nearest))
            assert outcome.distance == distance_to(center, item)


def test_an_egg_that_cracks_before_it_is_taken_ends_nothing(arena):
    """Its id is gone then; the distance is to where it was, and nobody can pick it up any more."""
    kitchen = arena("kitchen-2-seed4", 99)
    start = kitchen.states.starts[13]
    (egg, *_) = (key for key, item in start.view.objects.items() if item.object_type == "Egg")
    environment = ArmEnvironment(kitchen.trajectory, kitchen.simulator)
    begun = environment.reset(
        kitchen.episodes[13], replace(start, object_id=egg), Conversion(), Grasp(), NoFrames()
    )  # fmt: skip
    outcome = environment.step([{"action": "BreakObject", "objectId": egg, "forceAction": True}])
    assert egg not in outcome.view.objects
    assert (outcome.ended, outcome.distance) == (None, begun.distance)
    assert environment.step(gripper(0.0)).ended is None


def test_closest_is_the_smallest_of_the_start_and_all_steps(room):
    names = ("planner-arm", "random-arm", "still")
    for name, index in (*((name, BOOK) for name in names), ("random-arm", INTO_DRAWER)):
        record = room.play(actor(name), index, max_steps=6)
        distances = [step.distance for step in record.steps]
        assert record.closest == min([record.start_distance, *distances])
    still = room.play(actor("still"), BOOK)
    assert still.closest == still.start_distance == still.steps[0].distance
