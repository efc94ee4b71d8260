"""What a policy with episodes is told: when they begin and end, its hand, a view from the wrist."""

import math

import pytest

from infthor_eval.errors import UsageError
from infthor_eval.runs import execute
from infthor_eval.runs.work import binding

from .scripted import EpisodesPolicy

pytestmark = pytest.mark.usefixtures("shared_simulators")


@pytest.fixture
def run(prepare_run, monkeypatch):
    """Runs a policy of this module on a pick-up and a put; returns it and the records."""

    def run(**changes):
        policy = EpisodesPolicy()
        monkeypatch.setattr(binding, "load", lambda *_: policy)
        return policy, execute(prepare_run("openvla-tiny", **changes)).records

    return run


def test_it_is_told_of_each_episode_and_how_it_ended(run):
    policy, records = run()
    assert [record.payload.instruction for record in records] == [
        episode.instruction for episode, _, _ in policy.episodes
    ]
    assert len({episode.name for episode, _, _ in policy.episodes}) == len(records) > 1
    assert [ends for _, _, ends in policy.episodes] == [[r.payload.done] for r in records]
    assert not any(record.failure for record in records)
    for (_, seen, _), record in zip(policy.episodes, records, strict=True):
        assert [it.step for it in seen] == [*range(len(record.payload.steps))]
        assert all(it.wrist is None and it.state is None for it in seen)


def test_its_hand_is_where_it_moved_it(run):
    policy, records = run(cameras="front,wrist", state=True)
    for (_, seen, _), record in zip(policy.episodes, records, strict=True):
        first = seen[0].state
        is_put = record.payload.receptacle_id is not None
        assert first.gripper == (0.0 if is_put else 1.0)
        assert math.hypot(*first.position) < 1
        if len(seen) > 1 and not record.payload.steps[0].refusals:
            pairs = zip(first.position, seen[1].state.position, strict=True)
            moved = [after - before for before, after in pairs]
            assert moved == pytest.approx([0.02, 0.01, 0.03], abs=2e-3)
            assert seen[1].state.rotation == pytest.approx((0.0, 0.1, 0.2), abs=1e-3)
    assert max(len(seen) for _, seen, _ in policy.episodes) > 10
    assert len({wrist for _, wrist in policy.pixels}) > len(records)
    assert all(wrist not in (None, image) for image, wrist in policy.pixels)


def test_the_agents_view_and_the_outcome_are_the_same_with_a_camera_at_the_wrist(run):
    plain, records = run()
    told, others = run(cameras="front,wrist", state=True)
    assert [image for image, _ in plain.pixels] == [image for image, _ in told.pixels]
    assert [r.payload.steps for r in records] == [r.payload.steps for r in others]
    assert records[0].fingerprint != others[0].fingerprint


def test_blank_frames_are_blank_at_the_wrist_too(run):
    policy, _ = run(cameras="front,wrist", frames="blank")
    assert {image for image, _ in policy.pixels} == {wrist for _, wrist in policy.pixels}


@pytest.mark.parametrize("changes", [{"cameras": "front,wrist"}, {"state": True}])
@pytest.mark.parametrize("model", ["planner-arm", "openvla-tiny"])
def test_who_takes_a_frame_alone_is_refused(prepare_run, changes, model):
    with pytest.raises(UsageError, match="leave --cameras and --state out"):
        execute(prepare_run(model, **changes))
