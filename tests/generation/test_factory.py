"""Algorithm 1 on the embedded simulator: what holds between tasks and at the end."""

import dataclasses
import subprocess
import time
from pathlib import Path

import msgspec
import pytest
from msgspec.structs import replace

from infthor_eval.errors import UsageError
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.step_log import read_steps
from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.generation import factory
from infthor_eval.generation.factory import KnownFailures, generate
from infthor_eval.generation.final_task import EndTypes, end_types, violation
from infthor_eval.generation.generate_set import generate_set
from infthor_eval.generation.replay_set import replay_set, select
from infthor_eval.generation.replay_summary import summarise
from infthor_eval.generation.settings import MEMORY, TrajectorySettings
from infthor_eval.generation.trace import RolloutError
from infthor_eval.household.tasks import TaskType
from infthor_eval.thor.grounding import Grounding
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.recorded import translate
from infthor_eval.thor.recorder import object_log
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import Vector
from tests.household.rooms import APPLE, COUNTER, FRIDGE, KITCHEN, KNIFE, MUG, TABLE
from tests.thor.views import view

from ..helpers.command_line import option_words
from ..helpers.processes import cli_words

SHARED = Path(__file__).parents[2] / "../shared/data"
OTHERS = [item for item in KITCHEN.objects.values() if item.object_id != MUG.object_id]


def test_every_task_begins_with_an_empty_hand(simulator):
    # What was looked at is still in the hand, and is put down between the tasks.
    generated = generate(
        TrajectorySettings("bedroom-3", 0, 60, 3, task_types=(TaskType.EXAMINE,)), simulator
    )
    trajectory = generated.trajectory
    assert [entry["step"] for entry in trajectory.object_log] == list(
        range(len(trajectory.plan.low_actions) + 1)
    )
    kinds = [task.task_info.goal for task in trajectory.sub_tasks]
    assert kinds == [TaskType.EXAMINE, TaskType.PUT_AWAY] * (len(kinds) // 2)
    for part in trajectory.sub_trajs:
        held = trajectory.object_log[part.low_pddl_idx[0]]["inven_obj"]
        assert bool(held) == (kinds[part.sub_traj_idx] == TaskType.PUT_AWAY)
    assert trajectory.object_log[-1]["inven_obj"] == []
    n_accepted = generated.statistics.accepted.total()
    assert generated.statistics.tried.total() >= n_accepted == kinds.count(TaskType.EXAMINE) >= 2
    assert len(generated.problems) == len(kinds)


def test_sub_goals_and_actions_are_numbered_through(simulator):
    trajectory = generate(TrajectorySettings("living-room-2", 5, 60, 4), simulator).trajectory
    plan = trajectory.plan
    assert [high.high_idx for high in plan.high_pddl] == list(range(len(plan.high_pddl)))
    assert len(plan.high_pddl) >= 4
    assert [low.low_idx for low in plan.low_actions] == list(range(len(plan.low_actions)))
    assert len(plan.low_actions) >= 60
    owners = [low.high_idx for low in plan.low_actions]
    assert owners == sorted(owners) and set(owners) == set(range(len(plan.high_pddl)))
    ends = [0]
    for part in trajectory.sub_trajs:
        first, end = part.low_pddl_idx
        assert ends[-1] == first < end <= len(plan.low_actions)
        assert all(
            part.high_pddl_idx[0] <= owner < part.high_pddl_idx[1] for owner in owners[first:end]
        )
        ends.append(end)
    assert ends[-1] == len(plan.low_actions)


def test_published_words_change_nothing_else(simulator):
    plain = TrajectorySettings("living-room-2", 5, 60, 4)
    settings = dataclasses.replace(plain, words=Words.PUBLISHED)
    natural, published = (generate(each, simulator).trajectory for each in (plain, settings))
    assert (natural.plan, natural.scene) == (published.plan, published.scene)
    assert [task.task_info for task in natural.sub_tasks] == [
        task.task_info for task in published.sub_tasks
    ]
    assert (natural.gen_info["words"], published.gen_info["words"]) == ("natural", "published")
    infos = [task.task_info for task in published.sub_tasks]
    names = {(info.pickup or info.movable).lower() for info in infos}
    for task, part in zip(published.sub_tasks, published.sub_trajs, strict=True):
        assert part.subgoal == task.task_desc
        assert names & set(task.task_desc.lower().split())
    assert natural.sub_tasks != published.sub_tasks
    again = generate(settings, simulator).trajectory
    assert again.sub_tasks == published.sub_tasks


def test_the_final_task_is_about_both_ends_and_comes_last(simulator):
    trajectory = generate(
        TrajectorySettings("kitchen-2", 3, 60, 1, final_task=True), simulator
    ).trajectory
    assert violation(trajectory) is None
    assert len(trajectory.sub_trajs) == len(trajectory.sub_tasks)
    assert trajectory.sub_tasks[-1] == trajectory.long_horizon_task
    assert trajectory.sub_trajs[-1].subgoal == trajectory.long_horizon_task.task_desc
    assert trajectory.sub_trajs[-1].low_pddl_idx[1] == len(trajectory.plan.low_actions)


SHORT = TrajectorySettings("kitchen-2", 3, 20, 1, final_task=True)


@pytest.mark.parametrize(("memory", "n_tries"), [(False, 1), (True, 3)])
def test_where_no_final_task_works_the_trajectory_is_discarded(
    memory, n_tries, simulator, monkeypatch
):
    asked = []

    def nothing(log, alone):
        asked.append((len(log), alone))
        return (EndTypes(frozenset(), frozenset(), frozenset()),) * 2

    monkeypatch.setattr(factory, "end_types", nothing)
    monkeypatch.setattr(factory, "_MAX_ADDED", 2)
    settings = dataclasses.replace(SHORT, final_task=MEMORY if memory else True)
    with pytest.raises(UsageError, match="kitchen-2, seed 3: no final task works"):
        generate(settings, simulator)
    assert {alone for _, alone in asked} == {memory}
    lengths = [length for length, _ in asked]
    assert lengths == sorted(set(lengths)) and len(lengths) == n_tries


def test_a_final_task_that_needs_a_memory_is_on_what_is_seen_nowhere_else(simulator, monkeypatch):
    def alone_there(log, alone):
        assert alone
        # As if each end had been seen alone, which a short trajectory in one room has seldom.
        return end_types(log)

    monkeypatch.setattr(factory, "end_types", alone_there)
    trajectory = generate(dataclasses.replace(SHORT, final_task=MEMORY), simulator).trajectory
    assert trajectory.gen_info["final_task"] == "memory"
    assert trajectory.sub_tasks[-1] == trajectory.long_horizon_task


@pytest.mark.parametrize(("scene", "seed"), [("living-room-3", 2), ("FloorPlan317", 0)])
def test_looking_for_places_leaves_no_trace(scene, seed, tmp_path):
    # In the floor plan an open drawer is out of sight from where it was opened to look into it.
    data = SHARED if scene.startswith("FloorPlan") else None
    if data is not None and not data.is_dir():
        pytest.skip("recorded floor plans not at ../shared/data")
    with Simulator(embedded_launch(data)) as simulator:
        (path,) = generate_set(
            [TrajectorySettings(scene, seed, 150, 1)], simulator, tmp_path / "trajectories"
        ).paths
    with Simulator(embedded_launch(data)) as simulator:
        summary = summarise(replay_set(select([path]), simulator, tmp_path / "set"))
    assert summary.complete == 1, summary.diverged
    trajectory = next(iter_trajectories(path))
    object_logs = [
        {key: value for key, value in entry.items() if key != "step"}
        for entry in trajectory.object_log
    ]
    steps = read_steps(tmp_path / "set" / "metadata" / trajectory.traj_id)
    assert object_logs == [msgspec.to_builtins(step.object_log) for step in steps]


def test_the_lengths_are_in_steps_and_subgoals_with_put_downs(simulator):
    generated = generate(
        TrajectorySettings("living-room-2", 1, 1, 3, task_types=(TaskType.PLACE,)), simulator
    )
    assert len(generated.trajectory.sub_tasks) == len(generated.trajectory.sub_trajs) == 3
    looks = generate(
        TrajectorySettings("bedroom-3", 0, 1, 4, task_types=(TaskType.EXAMINE,)), simulator
    )
    goals = [task.task_info.goal for task in looks.trajectory.sub_tasks]
    assert goals == [TaskType.EXAMINE, TaskType.PUT_AWAY] * 2


def test_a_thousand_steps_are_made_with_the_defaults(simulator):
    generated = generate(TrajectorySettings("bathroom-4", 4, 1000), simulator)
    assert len(generated.trajectory.plan.low_actions) >= 1000
    assert generated.statistics.accepted.total() >= 0.65 * generated.statistics.tried.total()
    assert _refused(generated.trajectory, simulator) == []


def test_five_thousand_steps_are_made_and_replayed(simulator):
    generated = generate(TrajectorySettings("living-room-1", 1, 5000), simulator)
    assert len(generated.trajectory.plan.low_actions) >= 5000
    assert _refused(generated.trajectory, simulator) == []


def _refused(trajectory, simulator):
    """The actions that a replay of the trajectory refuses, and the first frame whose log
    differs."""
    restore(simulator, trajectory.scene)
    grounding = Grounding(simulator.view)
    refused = []
    for number, low in enumerate(trajectory.plan.low_actions, 1):
        view = simulator.step(**translate(low, grounding, simulator.view))
        log = {"step": number, **msgspec.to_builtins(object_log(view))}
        if not view.success or log != trajectory.object_log[number]:
            refused.append((number, view.error))
    return refused


@pytest.fixture
def fail_while(monkeypatch):
    """Makes plans fail after their first action, as long as `while_` says so of the factory."""

    def fail_while(while_):
        execute = factory._Factory._execute

        def fail(self, act, look):
            outcome = execute(self, act, look)
            if outcome.failure is None and while_(self):
                return factory._Outcome(RolloutError("made to fail"), executed=True)
            return outcome

        monkeypatch.setattr(factory._Factory, "_execute", fail)

    return fail_while


def times_from(n_times, n_subgoals):
    """Whether a plan is one of the first so many since there are so many sub-goals."""
    reached, tries = [], iter(range(10_000))

    def while_(generated):
        reached.append(generated._draft.n_subgoals)
        return max(reached) >= n_subgoals and next(tries) < n_times

    return while_


def test_at_dead_ends_1_2_and_4_subgoals_are_dropped(simulator, fail_while):
    fail_while(times_from(9, 8))
    kinds = (TaskType.PLACE, TaskType.PLACE_TWO)  # which leave nothing in the hand
    generated = generate(
        TrajectorySettings("living-room-2", 5, 150, 9, task_types=kinds, max_fail=2), simulator
    )
    assert [item.subgoals for item in generated.statistics.roll_backs] == [1, 2, 4]
    went_back = generated.trajectory.gen_info["roll_backs"]
    assert [item["from_step"] for item in went_back[1:]] == [
        item["to_step"] for item in went_back[:-1]
    ]
    assert len(generated.trajectory.sub_tasks) == len(generated.problems) >= 9
    assert generated.statistics.reasons["made to fail"] == 9
    assert _refused(generated.trajectory, simulator) == []


def test_at_dead_ends_a_put_down_is_dropped_with_its_task(simulator, fail_while):
    fail_while(times_from(4, 4))
    kinds = (TaskType.EXAMINE,)  # which leave the object in the hand
    generated = generate(
        TrajectorySettings("bedroom-3", 0, 30, 5, task_types=kinds, max_fail=1), simulator
    )
    # The published generator drops one, and two.
    assert [item.subgoals for item in generated.statistics.roll_backs] == [2, 2]
    goals = [task.task_info.goal for task in generated.trajectory.sub_tasks]
    assert goals == [TaskType.EXAMINE, TaskType.PUT_AWAY] * (len(goals) // 2)
    assert _refused(generated.trajectory, simulator) == []


def test_an_accepted_task_ends_the_row_of_failures(simulator, fail_while):
    tries = iter(range(10_000))
    # What fails of itself is among the other two.
    fail_while(lambda _: next(tries) % 4 < 2)
    generated = generate(TrajectorySettings("living-room-2", 5, 60, 6, max_fail=4), simulator)
    assert (
        generated.statistics.roll_backs == [] and generated.statistics.reasons["made to fail"] >= 6
    )


@pytest.mark.parametrize("floor", [0, 40, 10_000])
def test_what_gives_up_is_kept_from_a_floor_on(simulator, fail_while, floor):
    fail_while(times_from(10_000, 4))
    settings = TrajectorySettings("living-room-2", 5, 300, 3, True, max_fail=2, save_floor=floor)
    if floor != 40:
        with pytest.raises(
            UsageError, match=r"no further task works after .* failed tasks \(.*made to fail"
        ):
            generate(settings, simulator)
        return
    generated = generate(settings, simulator)
    trajectory = generated.trajectory
    assert len(trajectory.plan.low_actions) >= 40
    assert len(trajectory.sub_tasks) == len(generated.problems) == 4
    assert trajectory.gen_info["banked_on_giveup"] is True
    assert trajectory.long_horizon_task is None
    assert _refused(trajectory, simulator) == []


def test_a_pool_of_tasks_that_is_exhausted_begins_again(simulator):
    settings = TrajectorySettings("bathroom-4", 2, 700, 1, task_types=(TaskType.CLEAN,))
    generated = generate(settings, simulator)
    assert (
        generated.statistics.pool_restarts
        and generated.trajectory.gen_info["pool_restarts"] == generated.statistics.pool_restarts
    )


def test_the_same_bytes_come_out_after_a_kill_with_roll_backs(run_cli, tmp_path):
    lengths = option_words(min_steps=150, min_subgoals=1, max_fail=1)
    words = ["generate", *option_words(scene="kitchen-5", seed=5), *lengths]
    assert run_cli(*words, "--out", tmp_path / "whole")[0] == 0
    killed = subprocess.Popen(cli_words(*words, "--out", tmp_path / "killed"))
    time.sleep(6)
    killed.kill()
    killed.wait()
    assert run_cli(*words, "--out", tmp_path / "killed")[0] == 0
    name = "kitchen-5-seed5.json"
    assert (tmp_path / "whole" / name).read_bytes() == (tmp_path / "killed" / name).read_bytes()


def test_a_task_type_that_the_room_offers_nothing_for_is_one_line(simulator):
    with pytest.raises(
        UsageError, match=r"scene living-room-1, seed 0: no further task works after 0 steps"
    ) as error:
        generate(
            TrajectorySettings("living-room-1", 0, 10, 1, task_types=(TaskType.HEAT,)), simulator
        )
    assert "\n" not in str(error.value)


def items(room):
    return {item for item, _ in room.start.where}


def test_an_object_out_of_reach_is_no_item_until_it_moves():
    failures = KnownFailures()
    failures.note(KITCHEN, MUG.object_id, None)
    assert failures and MUG.object_id not in items(failures.room(KITCHEN))
    moved = view(*OTHERS, replace(MUG, position=Vector(3.0, 0.9, 0.0)))
    assert MUG.object_id in items(failures.room(moved))
    assert not failures


def test_a_full_receptacle_refuses_until_it_loses_something():
    failures = KnownFailures()
    failures.note(KITCHEN, MUG.object_id, FRIDGE.object_id)
    pair = (MUG.object_id, FRIDGE.object_id)
    assert failures.room(KITCHEN).refused == {pair}
    fuller = view(*OTHERS, replace(MUG, parent_receptacles=[FRIDGE.object_id]))
    assert failures.room(fuller).refused == {pair}
    without_apple = [item for item in KITCHEN.objects.values() if item.object_id != APPLE.object_id]
    emptier = view(*without_apple, replace(APPLE, parent_receptacles=[TABLE.object_id]))
    assert not failures.room(emptier).refused


def test_failures_are_forgotten_after_some_tasks():
    failures = KnownFailures()
    failures.note(KITCHEN, KNIFE.object_id, None)
    failures.note(KITCHEN, MUG.object_id, COUNTER.object_id)
    n_tasks = 0
    while failures.room(KITCHEN) and failures:
        failures.task_done()
        n_tasks += 1
    assert 1 < n_tasks < 30


def test_forgetting():
    failures = KnownFailures()
    failures.note(KITCHEN, KNIFE.object_id, None)
    failures.forget()
    assert not failures and KNIFE.object_id in items(failures.room(KITCHEN))


def test_an_object_that_is_gone_is_not_remembered():
    failures = KnownFailures()
    failures.note(KITCHEN, "Egg|+00.00|+00.00|+00.00", None)
    assert not failures
