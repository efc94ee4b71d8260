"""One trajectory as an environment, on the embedded simulator."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.trajectory import Trajectory, iter_trajectories
from infthor_eval.plans.environment import Ended, PlanEnvironment
from infthor_eval.plans.expert import ExpertRefusedError
from infthor_eval.thor.frames import FrameFolder
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator

from ..helpers.bundled import BUNDLED, bundled_name
from ..helpers.prompts import join_parts
from ..helpers.trajectories import LAMP, read_trajectory


def trajectory(scene: str = "kitchen-2") -> Trajectory:
    return next(iter_trajectories(BUNDLED / "metadata" / bundled_name(scene) / "traj_data.json"))


def play(environment, plan):
    """The expert's actions of a plan; the outcomes."""
    environment.reset(plan)
    outcomes = []
    for action in environment.expert_actions(plan):
        outcomes.append(environment.step(action.call))
        if outcomes[-1].terminated:
            break
    return outcomes


def test_any_plan_can_be_reset_to_from_any_moment_and_is_the_same_each_time(simulator):
    environment = PlanEnvironment(trajectory(), simulator)
    last = len(environment.plans) - 1
    seen = {}
    for plan in (0, last, 3, 0, 7, 3, last, 7):
        observation, info = environment.reset(plan)
        state = observation.view.agent, observation.view.inventory, info
        if plan in seen:
            assert state == seen[plan][0]
            assert np.array_equal(observation.view.frame, seen[plan][1])
        seen[plan] = state, observation.view.frame
        environment.step("RotateRight")
        environment.step("LookDown")
    assert len({str(state) for state, _ in seen.values()}) == 4


def test_the_expert_earns_all_there_is(simulator):
    environment = PlanEnvironment(trajectory(), simulator)
    for plan in environment.plans:
        _, info = environment.reset(plan.index)
        outcomes = play(environment, plan.index)
        assert outcomes[-1].info.ended == Ended.DONE
        assert sum(outcome.reward for outcome in outcomes) == pytest.approx(info["max_reward"])


def test_a_goal_that_comes_to_hold_when_the_way_is_over_is_not_counted_on(simulator):
    """The lamp is on, and in view from the first step of the way on; often it is from the last
    steps on only."""
    environment, plan = PlanEnvironment(read_trajectory(LAMP), simulator), 8
    assert environment.reset(plan)[1]["max_reward"] == pytest.approx(9.8)
    assert sum(outcome.reward for outcome in play(environment, plan)) == pytest.approx(9.8)
    actions = environment._expert._actions[plan]
    actions[:] = [replace(action, completes=action is actions[-1]) for action in actions]
    assert environment.reset(plan)[1]["max_reward"] == pytest.approx(4.8)


@pytest.mark.parametrize(
    ("text", "ended"),
    [
        ("", Ended.NO_ACTION),
        ("I will go", Ended.NO_ACTION),
        ("PickupObject", Ended.NO_ACTION),
        ("PickupObject Unicorn", Ended.UNKNOWN_OBJECT),
        ("PutObject Fork Fridge", Ended.NOT_POSSIBLE),
    ],
)
def test_what_is_no_action_here_ends_the_plan_and_earns_nothing(simulator, text, ended):
    environment = PlanEnvironment(trajectory(), simulator)
    environment.reset(0)
    outcome = environment.step(text)
    assert (outcome.reward, outcome.terminated, outcome.truncated) == (0.0, True, False)
    assert outcome.info.ended == ended
    assert outcome.info.message
    with pytest.raises(RuntimeError, match="reset"):
        environment.step("MoveAhead")


def test_a_refused_action_ends_the_plan_and_the_limit_truncates_it(simulator):
    environment = PlanEnvironment(trajectory(), simulator, max_steps=3)
    environment.reset(1)
    outcomes = [environment.step("NoOp") for _ in range(3)]
    assert [outcome.truncated for outcome in outcomes] == [False, False, True]
    assert outcomes[-1].info.ended == Ended.LIMIT
    environment = PlanEnvironment(trajectory(), simulator)
    environment.reset(0)
    for _ in range(50):
        outcome = environment.step("MoveAhead")
        if outcome.terminated:
            break
    assert outcome.info.ended == Ended.REFUSED
    assert outcome.info.message


def test_the_history_is_the_sequence_that_models_are_trained_on(simulator, tmp_path):
    recorded = trajectory()
    environment = PlanEnvironment(recorded, simulator, frames=FrameFolder(tmp_path))
    last = len(environment.plans) - 1
    environment.reset(last)
    play(environment, last)
    past = environment.past(last)
    text = "".join(join_parts(segment.parts()) for segment in past.all)
    text_file = (BUNDLED / "metadata" / recorded.traj_id / "traj.txt").read_text().strip()
    assert text_file.startswith(text)
    assert text_file[len(text) :].startswith("<|act|>")


class _FullFor(FrameFolder):
    """A disk that is full when one of the frames is written."""

    def __init__(self, folder, number):
        super().__init__(folder)
        self._left = number

    def keep(self, view):
        self._left -= 1
        if self._left == 0:
            raise DataError("the disk is full")
        return super().keep(view)


@pytest.fixture(scope="module")
def segmenting_simulator():
    with Simulator(embedded_launch(), max_copies=64) as simulator:
        yield simulator


def test_a_disk_that_was_full_in_between_changes_nothing_that_is_remembered(
    segmenting_simulator, tmp_path
):
    pasts = []
    for name, number in (("sound", 0), ("full", 6)):
        (tmp_path / name).mkdir()
        frames = _FullFor(tmp_path / name, number)
        environment = PlanEnvironment(
            trajectory(), segmenting_simulator, frames=frames, in_words=True
        )
        if number:
            with pytest.raises(DataError, match="full"):
                environment.reset(1)
        environment.reset(1)
        pasts.append(environment.past(1))
    sound, full = pasts
    assert sound.state == full.state
    n_steps, again = ([len(segment.steps) for segment in past.all] for past in pasts)
    assert n_steps == again


def test_an_expert_that_is_refused_here_is_named_and_the_plans_before_go_on(simulator):
    recorded = trajectory()
    broken = 5
    first = next(low for low in recorded.plan.low_actions if low.high_idx == broken)
    first.api_action.action = "OpenObject"
    first.api_action.object_id = "Wardrobe|+00.00|+00.00|+00.00"
    environment = PlanEnvironment(recorded, simulator)
    assert play(environment, 4)[-1].info.ended == Ended.DONE
    for plan in (5, 6):
        expected = r"OpenObject Wardrobe, in plan 5\) is refused here"
        with pytest.raises(ExpertRefusedError, match=expected):
            environment.reset(plan)
    environment.reset(0)


def test_a_task_without_a_goal_is_named(tmp_path):
    folder = BUNDLED / "metadata" / bundled_name("kitchen-2")
    document = json.loads((folder / "traj_data.json").read_text())
    document["sub_tasks"][0]["task_info"]["goal"] = ""
    path = tmp_path / "trajectory.json"
    path.write_text(json.dumps(document))
    with pytest.raises(DataError, match="task 0"):
        PlanEnvironment(next(iter_trajectories(Path(path))), None)


def test_preparing_a_plan_does_not_take_longer_the_later_it_is(simulator):
    environment = PlanEnvironment(trajectory("living-room-2"), simulator)
    last = len(environment.plans) - 1
    environment.reset(last)
    calls = []
    step = simulator.step
    simulator.step = lambda *args, **kwargs: calls.append(args) or step(*args, **kwargs)
    try:
        for plan in (1, last):
            calls.clear()
            environment.reset(plan)
            assert len(calls) <= 4  # nothing is repeated
    finally:
        del simulator.step


def test_a_simulator_that_keeps_no_copies_repeats_what_was_done(simulator, monkeypatch):
    """As Unity does."""
    recorded = trajectory("bedroom-1")
    expected = PlanEnvironment(recorded, simulator).reset(3)
    query = simulator.query
    unsaved = query("Pass")
    object.__setattr__(unsaved, "success", False)
    monkeypatch.setattr(
        simulator,
        "query",
        lambda action, **kw: unsaved if "State" in action else query(action, **kw),
    )
    environment = PlanEnvironment(recorded, simulator)
    environment.reset(1)
    environment.step("RotateLeft")
    observation, info = environment.reset(3)
    assert (observation.view.agent, info) == (expected[0].view.agent, expected[1])
    assert np.array_equal(observation.view.frame, expected[0].view.frame)
