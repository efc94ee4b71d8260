"""A trajectory's pictures and `timeline.json`, as the published renderer writes them.

The authors' website plays such folders: their `scripts/build_web_traj_assets.py` makes a film and
the page's data of one. Pictures are JPEG, `frames/000000.jpg` before the first action, then one
after each. With `smooth` N, a move or look has N of them and a turn 2N: those before the last show
poses between, at which the agent is put by TeleportFull.

Differences from the published `env_utils/render_traj.py` (main, July 2026): poses between are
rendered after the action and not before it, so that an action that is refused has none; the agent
is put there by force, as AI2-THOR 5.x refuses places off its grid; and an object that is not found
by its id is replaced before the action, not after a refusal.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec
from PIL import Image

from infthor_eval.errors import DataError, SimulatorError
from infthor_eval.formats.object_ids import name_of_original
from infthor_eval.formats.trajectory import LowAction, Trajectory, TrajectorySource
from infthor_eval.generation.motion import intermediate_views
from infthor_eval.generation.replay import ActionReplay, ReplayReport
from infthor_eval.generation.simulator_jobs import OnProgress, ignore_progress
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView

_TURNS = ("RotateLeft", "RotateRight")
_SMOOTHED = ("MoveAhead", *_TURNS, "LookUp", "LookDown")


class RenderSettings(msgspec.Struct, frozen=True):
    """Pictures and `timeline.json`, as a form of what replays write (`replay_set.ReplayForm`).

    Attributes:
        smooth: number of pictures of a move or look; a turn has twice as many, unless it is 1.
        width: width of the pictures, pixels.
        height: height of the pictures, pixels.
        quality: AI2-THOR's name of Unity's rendering quality; None for the embedded simulator.
        jpeg_quality: quality of the JPEG files, 1 to 100.
        keep_going: False to end a trajectory before its first refused action.
    """

    smooth: int = 1
    width: int = 640
    height: int = 640
    quality: str | None = None
    jpeg_quality: int = 88
    keep_going: bool = False

    @property
    def folder(self) -> str:
        """Folder of the trajectories' folders: that of the set."""
        return "."

    @property
    def simulator_options(self) -> Mapping[str, Any]:
        """Options of the `Simulator` that renders the pictures."""
        size = {"width": self.width, "height": self.height, "instances": False}
        return size if self.quality is None else {**size, "quality": self.quality}

    @property
    def report_type(self) -> type["RenderReport"]:
        """Type of `replay.json`."""
        return RenderReport

    def write(
        self,
        source: TrajectorySource,
        trajectory: Trajectory,
        simulator: Simulator,
        folder: Path,
        on_progress: OnProgress = ignore_progress,
    ) -> "RenderReport":
        """Write the pictures and the timeline of a trajectory."""
        scene = trajectory.scene.floor_plan
        report = RenderReport(trajectory.traj_id, source.digest, scene, self.smooth, settings=self)
        actions = ActionReplay(simulator, trajectory, report, on_progress)
        film = _Film(folder / "frames", self.jpeg_quality)
        film.add(simulator.view)
        log = _StepLog(trajectory)
        for index, low in enumerate(trajectory.plan.low_actions):
            before = simulator.view.agent
            _, error = actions.execute(index, low)
            if error is not None and not self.keep_going:
                break
            log.add(index, low, film.n_frames, simulator.view)
            n_frames = self._n_frames(low.api_action.action)
            after = simulator.view.agent
            for view in intermediate_views(simulator, before, after, n_frames, eased=True):
                film.add(view)
            film.add(simulator.view)
        timeline = self._timeline(source, scene, film.n_frames, log)
        (folder / "timeline.json").write_text(json.dumps(timeline), encoding="utf-8")
        return report

    def require_same(self, report: "RenderReport", folder: Path) -> None:
        """Raise DataError if an earlier folder was rendered with other settings."""
        if report.settings != self:
            raise DataError(
                f"{folder}: rendered with other settings; remove it or choose another --out"
            )

    def _n_frames(self, action: str) -> int:
        if self.smooth == 1 or action not in _SMOOTHED:
            return 1
        return self.smooth * 2 if action in _TURNS else self.smooth

    def _timeline(
        self, source: TrajectorySource, scene: str, n_frames: int, log: "_StepLog"
    ) -> dict[str, Any]:
        """Return the timeline; keys and their order are published."""
        return {
            "scene": scene,
            "source_json": source.path.name,
            "n_steps": len(log.steps),
            "n_frames": n_frames,
            "step_frames": log.step_frames,
            "smooth": self.smooth,
            "n_subgoals": len(log.subgoals),
            "n_objects_seen": len(log.first_seen),
            "width": self.width,
            "height": self.height,
            "subgoals": log.subgoals,
            # not that of `Trajectory`, which leaves out what we do not read
            "long_horizon_task": msgspec.json.decode(source.raw).get("long_horizon_task", {}),
            "first_seen": log.first_seen,
            "steps": log.steps,
        }


class RenderReport(ReplayReport):
    """Report of one rendering (`replay.json`), with its settings."""

    settings: RenderSettings = RenderSettings()


class _Film:
    """Numbered pictures in a new folder."""

    def __init__(self, folder: Path, jpeg_quality: int) -> None:
        folder.mkdir()
        self._folder = folder
        self._jpeg_quality = jpeg_quality
        self.n_frames = 0

    def add(self, view: SimulatorView) -> None:
        if view.frame is None:
            raise SimulatorError("the simulator sent no frame; start it with rendering on")
        path = self._folder / f"{self.n_frames:06d}.jpg"
        Image.fromarray(view.frame).save(path, quality=self._jpeg_quality)
        self.n_frames += 1


class _StepLog:
    """The parts of a timeline that grow with each step.

    Attributes:
        subgoals: each sub-goal's number, text, and range [start, end) of steps.
        steps: of each step, its number `t`, action `a`, type of object `o`, number of the sub-goal
            `sg`, and number of different things seen so far `nseen`.
        step_frames: number of the first picture of each step.
        first_seen: step at which each thing was first visible, in that order.
    """

    def __init__(self, trajectory: Trajectory) -> None:
        self.subgoals: list[dict[str, Any]] = []
        self.steps: list[dict[str, Any]] = []
        self.step_frames: list[int] = []
        self.first_seen: dict[str, int] = {}
        self._subgoal_of: dict[int, int] = {}
        for part in trajectory.sub_trajs:
            start, end = part.low_pddl_idx
            number = part.sub_traj_idx
            subgoal = {"idx": number, "text": part.subgoal, "start": start, "end": end}
            self.subgoals.append(subgoal)
            self._subgoal_of.update(dict.fromkeys(range(start, end), number))

    def add(self, index: int, low: LowAction, first_frame: int, after: SimulatorView) -> None:
        """Add a step whose first picture has a number, and which ended in a state."""
        self.step_frames.append(first_frame)
        visible = {_name_of(obj.name) for obj in after.objects.values() if obj.visible}
        for name in sorted(visible - self.first_seen.keys()):
            self.first_seen[name] = index
        object_id = low.api_action.object_id
        step = {
            "t": index,
            "a": low.api_action.action,
            "o": None if object_id is None else object_id.split("|")[0],
            "sg": self._subgoal_of.get(index, 0),
            "nseen": len(self.first_seen),
        }
        self.steps.append(step)


def _name_of(name: str) -> str:
    """Return the part of a Unity object's name before its number ("Mug_291e6e8a(Clone)")."""
    return name_of_original(name).split("_", maxsplit=1)[0]
