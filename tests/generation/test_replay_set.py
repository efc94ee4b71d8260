import gzip
import json
from pathlib import Path

import pytest
from PIL import Image

from infthor_eval.errors import DataError, SimulatorError
from infthor_eval.formats.set_info import claim_for_simulator, frames_of, simulator_of
from infthor_eval.formats.step_log import iter_object_states, read_steps
from infthor_eval.formats.trajectory import iter_sources, iter_trajectories
from infthor_eval.generation.generate_set import generate_set
from infthor_eval.generation.questions.generate import generate_questions
from infthor_eval.generation.replay import SetForm, box_iou
from infthor_eval.generation.replay_set import replay_set, select
from infthor_eval.generation.replay_summary import summarise
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.nieh.docs import doc_target
from infthor_eval.nieh.scoring import score
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.supplement import write_supplement

SHARED = Path(__file__).parents[2] / "../shared/data"
PUBLISHED = SHARED / "published_goldens"
JOB = TrajectorySettings("kitchen-3", 4, min_steps=40, min_subgoals=1)


@pytest.fixture(scope="module")
def generated(tmp_path_factory, simulator):
    out = tmp_path_factory.mktemp("generated")
    result = generate_set([JOB], simulator, out)
    assert not result.failures
    return result.paths[0]


def test_a_generated_trajectory_replays_whole(generated, tmp_path, simulator):
    replayed = replay_set(select([generated]), simulator, tmp_path)
    lock = tmp_path / "metadata" / f".{JOB.traj_id}.lock"
    lock.touch()  # of a process that was killed just then
    again = replay_set(select([generated]), simulator, tmp_path)
    trajectory = next(iter_trajectories(generated))
    assert summarise(replayed).complete == 1 and not replayed.failures
    assert (again.resumed, replayed.resumed) == (1, 0)
    assert not lock.exists()
    folder = tmp_path / "metadata" / trajectory.traj_id
    steps = read_steps(folder)
    frames = sorted((folder / "img").iterdir())
    assert len(steps) == len(frames) == len(trajectory.plan.low_actions) + 1 >= 41
    assert Image.open(frames[0]).size == (300, 300)
    assert [entry["visible"] for entry in trajectory.object_log] == [
        step.object_log.visible for step in steps
    ]
    last = list(iter_object_states(steps))[-1]
    assert last and all(state.type for state in last.values())
    images = json.loads((folder / "expert_log.json").read_text())["images"]
    assert [image["low_idx"] for image in images[:4]] == [0, 0, 1, 2]
    document = json.loads(generated.read_text())
    assert [(image["low_idx"], image["image_name"]) for image in document["images"]] == [
        (image["low_idx"], image["image_name"]) for image in images[1:]
    ]
    assert all(
        {"low_idx", "high_idx", "api_action"} <= set(low) for low in document["plan"]["low_actions"]
    )
    assert (folder / "traj.txt").read_text().startswith("<|goal|>Your main goal: ")
    assert not list((tmp_path / "metadata").glob(".*"))


def test_several_frames_per_move(generated, tmp_path, simulator):
    replayed = replay_set(select([generated]), simulator, tmp_path, form=SetForm(3))
    again = replay_set(select([generated]), simulator, tmp_path)
    assert summarise(replayed).complete == 1
    assert "3 frames per move" in again.failures[0].message
    steps = read_steps(tmp_path / "metadata" / JOB.traj_id)
    first = [step for step in steps if step.step == 1]
    assert [step.action is None for step in first] == [True, True, False]
    assert [step.img_idx for step in steps] == list(range(len(steps)))
    moves = sum(step.action is not None for step in steps)
    assert moves == len(next(iter_trajectories(generated)).plan.low_actions)
    assert (tmp_path / "metadata" / JOB.traj_id / "traj.txt").read_text().count(
        "<|act|>"
    ) == 2 * moves


def test_the_seed_decides_and_what_exists_is_kept(generated, tmp_path, simulator):
    generate_set([JOB], simulator, tmp_path)
    assert (tmp_path / generated.name).read_bytes() == generated.read_bytes()
    lock = tmp_path / f".{generated.name}.lock"
    lock.touch()  # of a process that was killed just then
    assert generate_set([JOB], simulator, tmp_path).resumed == 1
    assert not lock.exists()
    other = TrajectorySettings(JOB.scene, JOB.seed, min_steps=41, min_subgoals=1)
    assert "other settings" in generate_set([other], simulator, tmp_path).failures[0]


def test_one_bad_trajectory_does_not_stop_the_others(generated, tmp_path, simulator):
    good = generated.read_bytes()
    nowhere = json.loads(good)
    nowhere["scene"]["floor_plan"], nowhere["traj_id"] = "nowhere-1", "../../escape"
    lines = [json.dumps(nowhere).encode(), b"{broken", json.dumps(json.loads(good)).encode()]
    path = tmp_path / "all.jsonl.gz"
    path.write_bytes(gzip.compress(b"\n".join(lines)))
    replayed = replay_set(select([path]), simulator, tmp_path / "set")
    assert len(replayed.reports) == 1
    assert sorted(failure.place.rpartition(":")[2] for failure in replayed.failures) == ["1", "2"]
    assert all(failure.message.count(str(path)) == 1 for failure in replayed.failures)
    assert [folder.name for folder in (tmp_path / "set/metadata").iterdir()] == [JOB.traj_id]


def test_another_trajectory_of_the_same_name_is_refused(generated, tmp_path, simulator):
    changed = json.loads(generated.read_bytes())
    changed["plan"]["low_actions"] = changed["plan"]["low_actions"][:2]
    (tmp_path / "short.json").write_text(json.dumps(changed))
    replay_set(select([tmp_path / "short.json"]), simulator, tmp_path / "set")
    replayed = replay_set(select([generated]), simulator, tmp_path / "set")
    assert "another trajectory" in replayed.failures[0].message


@pytest.mark.skipif(not SHARED.is_dir(), reason="recorded data not at ../shared/data")
def test_recorded_trajectories_replay(tmp_path):
    selection = select([SHARED / "alfred/valid_seen.jsonl.gz"], limit=3, per_floor_plan=1)
    write_supplement(
        (trajectory for _, trajectory in selection.items), tmp_path / "supplement.json"
    )
    with Simulator(embedded_launch(SHARED, tmp_path / "supplement.json")) as simulator:
        replayed = replay_set(selection, simulator, tmp_path)
    summary = summarise(replayed)
    assert summary.trajectories == summary.floor_plans == 3
    assert summary.actions["MoveAhead"].accepted > 20
    assert summary.iou
    # Passed on as it came, with what the typed form leaves out.
    raw = json.loads(next((tmp_path / "metadata").glob("*/traj_data.json")).read_bytes())
    assert raw["turk_annotations"]


@pytest.mark.skipif(not PUBLISHED.is_dir(), reason="published trajectories not at ../shared/data")
def test_what_the_published_saver_writes_is_replayed_asked_about_and_evaluated(tmp_path):
    selection = select([PUBLISHED / f"floorplan28_{split}.json" for split in ("train", "test")])
    write_supplement((item for _, item in selection.items), tmp_path / "supplement.json")
    with Simulator(embedded_launch(SHARED, tmp_path / "supplement.json")) as simulator:
        summary = summarise(replay_set(selection, simulator, tmp_path / "set"))
    assert (summary.trajectories, summary.complete, summary.floor_plans) == (2, 2, 1), (
        summary.diverged
    )
    training, test = (item for _, item in selection.items)
    assert training.long_horizon_task is None
    assert (
        test.long_horizon_task.task_desc
        == test.sub_tasks[-1].task_desc
        == test.sub_trajs[-1].subgoal
    )
    generated = generate_questions(tmp_path / "set", per_trajectory=20)
    assert 30 < len(generated.questions) <= 40 and not generated.unconfirmed
    assert (
        "put a cold apple in the microwave"
        in (tmp_path / "set/metadata/floorplan28_test/traj.txt").read_text()
    )
    assert all(
        score(doc_target(question), question.answers, "strict") == 1.0
        for question in generated.questions
    )


def test_selection_limits(tmp_path):
    document = {
        "scene": {"floor_plan": "A", "init_action": {"x": 0, "y": 0, "z": 0}},
        "plan": {"low_actions": []},
    }
    rows = [
        json.dumps({**document, "scene": {**document["scene"], "floor_plan": name}})
        for name in "AABB"
    ]
    (tmp_path / "a.jsonl").write_text("\n".join(rows))
    assert len(list(iter_sources(tmp_path / "a.jsonl"))) == 4
    assert len(select([tmp_path / "a.jsonl"], per_floor_plan=1).items) == 2
    assert len(select([tmp_path / "a.jsonl"], limit=3).items) == 3


def test_overlap_of_boxes():
    assert box_iou((0, 0, 9, 9), (0, 0, 9, 9)) == 1.0
    assert box_iou((0, 0, 9, 9), (5, 0, 14, 9)) == pytest.approx(50 / 150)
    assert box_iou((0, 0, 1, 1), (5, 5, 6, 6)) == 0.0


def test_a_set_that_was_claimed_half_is_claimed_again(tmp_path, monkeypatch):
    def stop(self, *_arguments, **_options):
        self.write_bytes(b"{")
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_text", stop)
        with pytest.raises(KeyboardInterrupt):
            claim_for_simulator(tmp_path, "embedded")
    assert simulator_of(tmp_path) is None
    claim_for_simulator(tmp_path, "embedded")
    assert simulator_of(tmp_path) == "embedded"
    assert frames_of(tmp_path) is None


def test_a_set_is_not_continued_with_frames_of_another_version(tmp_path):
    claim_for_simulator(tmp_path, "embedded", 2)
    claim_for_simulator(tmp_path, "embedded", 2)
    assert frames_of(tmp_path) == 2
    with pytest.raises(DataError, match="version 2 of the drawing, this is 3; give another folder"):
        claim_for_simulator(tmp_path, "embedded", 3)


def test_the_simulator_error_is_told(simulator):
    with pytest.raises(SimulatorError, match="FloorPlan1"):
        simulator.reset("FloorPlan1")
