"""Recorded plans carried out again, on the embedded simulator."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from infthor_eval.errors import DataError, UsageError
from infthor_eval.plans.config import PlansConfig
from infthor_eval.plans.recorded.replaying import recorded_plans, replay_plans
from infthor_eval.plans.recorded.runs import PlansRun
from infthor_eval.plans.records import RECORDS, StepRecord
from infthor_eval.runs import read_run

from ...helpers.trajectories import FORK, cut_trajectory, write_trajectories
from ...helpers.trajectories import MUG as NAME


@pytest.fixture(scope="module")
def recorded(scripted_run):
    return recorded_plans(PlansRun("scripted", *read_run(scripted_run, RECORDS)), None, None)


@pytest.fixture(scope="module")
def session(recorded, scripted_data):
    with replay_plans(recorded, scripted_data, None) as session:
        yield session


def changed(record, **fields):
    """The same plan, otherwise recorded."""
    payload = msgspec.structs.replace(record.payload, **fields)
    return msgspec.structs.replace(record, payload=payload)


def with_identity(recorded, change):
    """The same recording of a run with another identity."""
    identity = recorded.run.header.config.document
    change(identity)
    config = msgspec.convert(identity, PlansConfig)
    header = msgspec.structs.replace(recorded.run.header, config=config)
    return replace(recorded, run=PlansRun("scripted", header, recorded.run.records))


def opened(recorded, data):
    with replay_plans(recorded, data, None):
        pass


def test_a_plan_is_its_start_and_its_actions_as_they_were_recorded(recorded, session):
    plans = recorded.between(1, 2)
    replayed = list(session.frames(plans))
    assert [frame.number for frame in replayed] == [
        n for plan in plans for n in range(len(plan.payload.steps) + 1)
    ]
    # The world went where it went then.
    assert [frame.note for frame in replayed] == [""] * len(replayed)
    assert all(frame.observation.frame.shape == (300, 300, 3) for frame in replayed)
    first, walk, end = replayed[0], replayed[1 : len(plans[0].payload.steps)], replayed[-1]
    assert (first.title.number, first.title.n_plans, first.title.text) == (1, 12, "go to the mug")
    assert (first.action, first.rewards.step) == ("", None)
    assert first.rewards.max_of_plan == plans[0].payload.max_reward
    # MoveAhead each time.
    assert [len(frame.observation.walked) for frame in walk] == list(range(2, len(walk) + 2))
    assert (end.action, end.ending, end.done) == ("PickupObject Mug", "done", True)
    assert end.observation.held == ("Mug",)
    refused = replayed[len(plans[0].payload.steps)]
    assert (refused.ending, refused.done) == ("refused by the simulator", False)
    assert refused.wrong.startswith("Wall is blocking")


def test_the_map_has_what_the_plan_is_about_and_where_it_leads(recorded, session):
    going, putting = (
        next(session.frames(recorded.between(number, number))).observation.room for number in (3, 4)
    )
    assert [thing.name for thing in going.objects if thing.is_named] == ["Desk"]
    assert going.goal.at in going.floor
    assert putting.goal is None
    assert {"Bed", "Dresser", "ArmChair"} <= {thing.name for thing in putting.objects}
    # The mug is in the hand.
    assert not {"Floor", "Pillow", "Mug"} & {thing.name for thing in putting.objects}


def test_rewards_add_up_over_the_trajectory(recorded, session):
    last = list(session.frames(recorded.records[3:4]))[-1]
    before = recorded.records[:4]
    assert last.rewards.so_far == pytest.approx(sum(plan.payload.reward for plan in before))
    assert last.rewards.max_so_far == pytest.approx(sum(plan.payload.max_reward for plan in before))
    assert (last.rewards.plan, last.goal_reached) == (7.0, True)


def test_excluded_plans_count_for_nothing(recorded, scripted_data):
    left_out = msgspec.structs.replace(recorded.records[1], excluded="the expert is refused")
    plans = (recorded.records[0], left_out, changed(recorded.records[2], steps=()))
    with replay_plans(replace(recorded, records=plans), scripted_data, None) as session:
        (frame,) = session.frames(plans[2:])
    first, _, third = (plan.payload for plan in recorded.records[:3])
    assert frame.rewards.so_far == first.reward
    assert frame.rewards.max_so_far == first.max_reward + third.max_reward


def test_what_differs_is_told_once_and_it_goes_on(recorded, session):
    plan = recorded.records[0]
    steps = plan.payload.steps
    paid = tuple(msgspec.structs.replace(step, reward=step.reward + 1) for step in steps)
    notes = [frame.note for frame in session.frames([changed(plan, steps=paid)])]
    earns = f"{steps[0].reward:g} now, and {steps[0].reward + 1:g} in the run"
    assert notes == ["", f"plan 1, action 1: MoveAhead earns {earns}", *[""] * (len(steps) - 1)]
    ended = (*steps[:-1], msgspec.structs.replace(steps[-1], message=""))
    *_, last = session.frames([changed(plan, steps=ended)])
    assert last.note.startswith("plan 1, action 7: MoveAhead is refused (Wall is blocking")
    longer = (*steps, steps[0])  # here the plan is over before
    replayed = list(session.frames([changed(plan, steps=longer)]))
    assert len(replayed) == len(longer) + 1
    assert replayed[-2].note == "plan 1, action 7: the plan ends now, and goes on in the run"


def test_a_reply_that_could_not_be_tried_shows_the_world_as_it_was(recorded, session):
    step = StepRecord(reply="jump high", message="unknown action 'jump'")
    start, end = session.frames([changed(recorded.records[0], steps=(step,), ended="no action")])
    assert (end.action, end.reply, end.ending) == ("", "jump high", "no action")
    assert end.wrong == "unknown action 'jump'"
    assert np.array_equal(start.observation.frame, end.observation.frame)
    spaced = msgspec.structs.replace(recorded.records[0].payload.steps[0], reply=" MoveAhead ")
    _, frame = session.frames([changed(recorded.records[0], steps=(spaced,))])
    assert frame.reply == ""  # it is the action


def test_an_action_recorded_as_a_call_names_its_object(recorded, session):
    plan = recorded.records[1]
    steps = plan.payload.steps
    bare = tuple(msgspec.structs.replace(step, action="PickupObject") for step in steps)
    assert list(session.frames([changed(plan, steps=bare)]))[1].action == "PickupObject Mug"


def test_of_plans_that_were_never_begun_only_the_words_are_there(recorded, session):
    idle = changed(recorded.records[0], steps=(), ended="not attempted")
    failed = msgspec.structs.replace(idle, failure="the model broke")
    excluded = msgspec.structs.replace(idle, excluded="the expert is refused")
    replayed = list(session.frames([idle, failed, excluded]))
    assert [frame.observation for frame in replayed] == [None] * 3
    reasons = ["failed: the model broke", "excluded: the expert is refused"]
    assert [frame.ending for frame in replayed] == ["not attempted", *reasons]


def test_plans_tasks_and_trajectories_that_are_not_there_are_named(recorded):
    run = recorded.run
    for first, last in ((0, 3), (12, 13), (5, 4)):
        expected = f"--plans {first}-{last}: the run has plans 1 to 12 of {NAME}"
        with pytest.raises(UsageError, match=expected):
            recorded.between(first, last)
    expected = f"unknown trajectory of this run 'kitchen'; there are {NAME}"
    with pytest.raises(UsageError, match=expected):
        recorded_plans(run, None, "kitchen")
    with pytest.raises(UsageError, match="unknown task of this run 'nieh'"):
        recorded_plans(run, "nieh", None)
    other = [msgspec.structs.replace(record, cluster="kitchen-1") for record in run.records]
    expected = f"more than one trajectory; give one of them with --trajectory: {NAME}, kit"
    with pytest.raises(UsageError, match=expected):
        recorded_plans(PlansRun("scripted", run.header, [*run.records, *other]), None, None)
    with pytest.raises(DataError, match="no record of an episode yet"):
        recorded_plans(PlansRun("scripted", run.header, []), None, None)


def test_only_the_runs_own_trajectory_will_do(recorded, scripted_data, tmp_path):
    def change(identity):
        identity["tasks"]["infthor_plans"]["trajectories"][NAME] = "0123"

    with pytest.raises(DataError, match=f"{NAME}: changed since the run; give the run's own"):
        opened(with_identity(recorded, change), scripted_data)
    with pytest.raises(UsageError, match="give them as --data FILE or FOLDER"):
        opened(recorded, None)
    kitchen = write_trajectories(tmp_path / "kitchen", cut_trajectory(FORK))
    expected = f"{NAME}: not among the trajectories of --data \\(kitchen-2-seed4\\)"
    with pytest.raises(DataError, match=expected):
        opened(recorded, kitchen)


def test_trajectories_that_come_with_the_package_are_found_by_name(recorded):
    def change(identity):
        identity["tasks"]["infthor_plans"]["config"]["dataset_kwargs"]["bundled"] = "nieh_mini"

    with pytest.raises(DataError, match=f"{NAME}: changed since the run"):  # so it was found
        opened(with_identity(recorded, change), None)


def test_rewards_of_another_version_are_an_error(recorded, scripted_data):
    def change(identity):
        identity["tasks"]["infthor_plans"]["rewards"] = {"per_smile": 1}

    strange = with_identity(recorded, change)
    with (
        replay_plans(strange, scripted_data, None) as session,
        pytest.raises(DataError, match="rewards that this version does not know"),
    ):
        list(session.frames(strange.records[:1]))
