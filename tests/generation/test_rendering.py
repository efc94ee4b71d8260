"""Pictures and timeline as the published renderer writes them, and what its website reads."""

import gzip
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from infthor_eval.formats.trajectory import TrajectorySource, iter_trajectories
from infthor_eval.generation.generate_set import generate_set
from infthor_eval.generation.rendering import RenderSettings
from infthor_eval.generation.replay_set import replay_set, select
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import AgentPose, SimulatorView, ThorObject, Vector

GOLDEN = Path(__file__).parents[1] / "goldens" / "rendering.jsonl.gz"
SHADES = {"initial": 0, "between": 120, "after": 240}
JOB = TrajectorySettings("kitchen-3", 4, min_steps=20, min_subgoals=1)


class ScriptedSimulator:
    """A simulator that succeeds, fails and sees as a golden case says."""

    label = "embedded"

    def __init__(self, case: dict) -> None:
        self._script = case["script"]
        actions = json.loads(case["given"])["plan"]["low_actions"]
        calls = [low["api_action"] for low in actions]
        ids = {
            call[key] for call in calls for key in ("objectId", "receptacleObjectId") if key in call
        }
        self._objects = [ThorObject(key, key.split("|")[0], "Hidden_1", Vector()) for key in ids]
        self.step_number = 0
        self.poses_between: list[tuple[int, AgentPose]] = []
        self.view = self._view("initial", True, (), AgentPose(Vector(), 0.0, 0.0))

    def _view(self, picture: str, success: bool, names: tuple[str, ...], pose: AgentPose):
        seen = [
            ThorObject(f"Seen|{number}", "Seen", name, Vector(), visible=True)
            for number, name in enumerate(names)
        ]
        objects = {obj.object_id: obj for obj in (*self._objects, *seen)}
        frame = np.full((8, 8, 3), SHADES[picture], np.uint8)
        error = "" if success else "refused"
        return SimulatorView(frame, None, objects, pose, (), success, error, "", None, "scripted")

    def reset(self, scene: str) -> SimulatorView:
        return self.view

    def step(self, action: str, **arguments) -> SimulatorView:
        pose = self.view.agent
        if action == "TeleportFull":
            position = Vector(**arguments["position"])
            pose = AgentPose(position, arguments["rotation"]["y"], arguments["horizon"])
            self.view = self._view("initial", True, (), pose)
            return self.view
        row = self._script[self.step_number]
        if row["success"]:
            pose = _pose_after(action, arguments, pose)
        self.view = self._view("after", row["success"], row["visible"], pose)
        self.step_number += 1
        return self.view

    def query(self, action: str, **arguments) -> SimulatorView:
        assert action == "TeleportFull"
        position = Vector(**arguments["position"])
        pose = AgentPose(position, arguments["rotation"]["y"], arguments["horizon"])
        self.poses_between.append((self.step_number - 1, pose))
        return self._view("between", True, (), pose)


def _pose_after(action: str, arguments: dict, pose: AgentPose) -> AgentPose:
    if action == "MoveAhead":
        yaw = np.radians(pose.rotation)
        step = arguments.get("moveMagnitude", 0.25)
        at = pose.position
        moved = Vector(at.x + step * float(np.sin(yaw)), at.y, at.z + step * float(np.cos(yaw)))
        return AgentPose(moved, pose.rotation, pose.horizon)
    turn = {"RotateLeft": -90.0, "RotateRight": 90.0}.get(action, 0.0)
    tilt = {"LookUp": -30.0, "LookDown": 30.0}.get(action, 0.0)
    return AgentPose(pose.position, (pose.rotation + turn) % 360, pose.horizon + tilt)


def _cases() -> list[dict]:
    return [json.loads(line) for line in gzip.decompress(GOLDEN.read_bytes()).splitlines()]


def _render(case: dict, folder: Path) -> ScriptedSimulator:
    source = TrajectorySource(Path(case["source"]), None, case["given"].encode())
    settings = RenderSettings(
        case["smooth"], case["width"], case["height"], keep_going=case["keep_going"]
    )
    simulator = ScriptedSimulator(case)
    settings.write(source, source.read(), simulator, folder)
    return simulator


@pytest.mark.parametrize("number", range(60))
def test_timeline_pictures_and_poses_are_the_published_ones(number, tmp_path):
    case = _cases()[number]
    simulator = _render(case, tmp_path)
    assert (tmp_path / "timeline.json").read_text() == case["timeline"]
    pictures = sorted((tmp_path / "frames").iterdir())
    shown = [[path.name, np.asarray(Image.open(path)).mean()] for path in pictures]
    expected = [[name, SHADES[shows]] for name, shows in case["pictures"]]
    assert shown == [[name, pytest.approx(shade, abs=3)] for name, shade in expected]
    _require_equal_poses(case["teleports"], simulator.poses_between)


def _require_equal_poses(published: list[list[float]], ours: list[tuple[int, AgentPose]]) -> None:
    """The last teleport of each step leads back: before the action there, after it here."""
    assert [row[0] for row in published] == [step for step, _ in ours]
    for number, (step, pose) in enumerate(ours):
        if number + 1 == len(ours) or ours[number + 1][0] != step:
            continue
        _, x, y, z, rotation, horizon = published[number]
        at = pose.position
        assert (at.x, at.y, at.z) == pytest.approx((x, y, z), abs=1e-9)
        assert (pose.rotation - rotation + 180) % 360 - 180 == pytest.approx(0, abs=0.0006)
        assert pose.horizon == pytest.approx(horizon, abs=0.0006)


@pytest.fixture(scope="module")
def generated(tmp_path_factory, simulator):
    out = tmp_path_factory.mktemp("generated")
    result = generate_set([JOB], simulator, out)
    assert not result.failures
    return result.paths[0]


@pytest.fixture(scope="module")
def rendered(generated, tmp_path_factory):
    """The folder of a trajectory that the embedded simulator rendered, three pictures a move."""
    out = tmp_path_factory.mktemp("rendered")
    settings = RenderSettings(3, 64, 48)
    with Simulator(embedded_launch(), **settings.simulator_options) as simulator:
        replayed = replay_set(select([generated]), simulator, out, form=settings)
        again = replay_set(select([generated]), simulator, out, form=settings)
        other = replay_set(select([generated]), simulator, out, form=RenderSettings(2, 64, 48))
    assert not replayed.failures and again.resumed == 1
    assert "rendered with other settings" in other.failures[0].message
    return out / JOB.traj_id


def test_the_website_finds_what_it_reads(generated, rendered):
    """What `build_web_traj_assets.py` and the page's `infini.js` read of a folder."""
    timeline = json.loads((rendered / "timeline.json").read_text())
    trajectory = next(iter_trajectories(generated))
    n_steps = len(trajectory.plan.low_actions)
    assert (timeline["scene"], timeline["n_steps"]) == ("kitchen-3", n_steps)
    # ffmpeg reads frames/%06d.jpg from 0 on, up to the first number without a file
    names = sorted(path.name for path in (rendered / "frames").iterdir())
    assert names == [f"{number:06d}.jpg" for number in range(timeline["n_frames"])]
    assert Image.open(rendered / "frames" / names[0]).size == (64, 48)
    first = timeline["step_frames"]
    assert first[0] == 1 and len(first) == n_steps
    ends = [*first[1:], timeline["n_frames"]]
    counts = {"MoveAhead": 3, "LookUp": 3, "LookDown": 3, "RotateLeft": 6, "RotateRight": 6}
    assert [end - start for start, end in zip(first, ends, strict=True)] == [
        counts.get(step["a"], 1) for step in timeline["steps"]
    ]
    assert [step["t"] for step in timeline["steps"]] == list(range(n_steps))
    # the ticker shows the last sub-goal that has begun
    starts = [subgoal["start"] for subgoal in timeline["subgoals"]]
    assert starts == sorted(starts) and starts[0] == 0
    assert [subgoal["text"] for subgoal in timeline["subgoals"]] == [
        part.subgoal for part in trajectory.sub_trajs
    ]
    assert timeline["n_subgoals"] == len(starts)
    assert timeline["n_objects_seen"] == len(timeline["first_seen"]) > 5
    assert timeline["long_horizon_task"].get("task_desc", "") == ""


def test_pictures_between_lead_from_one_to_the_next(rendered):
    """A turn's pictures differ less from their neighbours than its first and last do."""
    timeline = json.loads((rendered / "timeline.json").read_text())
    turn = next(step["t"] for step in timeline["steps"] if step["a"].startswith("Rotate"))
    first = timeline["step_frames"][turn]
    paths = [rendered / "frames" / f"{first - 1 + number:06d}.jpg" for number in range(7)]
    pictures = [np.asarray(Image.open(path)).astype(float) for path in paths]
    apart = np.abs(pictures[0] - pictures[-1]).mean()
    assert np.abs(pictures[0] - pictures[1]).mean() < apart / 2
    assert np.abs(pictures[-2] - pictures[-1]).mean() < apart / 2


def test_a_refused_action_ends_it_unless_asked_to_keep_going(generated, tmp_path):
    document = json.loads(generated.read_text())
    lows = document["plan"]["low_actions"]
    lows[4]["api_action"] = {"action": "PickupObject", "objectId": "Unicorn|+00.00|+00.00|+00.00"}
    (tmp_path / "odd.json").write_text(json.dumps(document))
    stops = RenderSettings(1, 64, 48)
    options = stops.simulator_options
    with Simulator(embedded_launch(), **options) as simulator:
        for form, n_steps in ((stops, 4), (RenderSettings(1, 64, 48, keep_going=True), len(lows))):
            out = tmp_path / str(n_steps)
            replayed = replay_set(select([tmp_path / "odd.json"]), simulator, out, form=form)
            timeline = json.loads((out / JOB.traj_id / "timeline.json").read_text())
            assert timeline["n_steps"] == n_steps
            assert timeline["n_frames"] == n_steps + 1
            assert replayed.reports[0].refusals[0].step == 4
