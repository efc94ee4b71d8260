"""Replaying one recorded trajectory to frames and a step log.

A refused action is logged with its message and the replay continues, as ALFRED's does. The log has
what really happened, so questions on it are still correct. The trajectory counts as diverged from
its first refused action on.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.errors import DataError
from infthor_eval.formats.pictures.png import PngWriter
from infthor_eval.formats.step_log import Step, write_steps
from infthor_eval.formats.trajectory import LowAction, Trajectory, TrajectorySource
from infthor_eval.generation.motion import intermediate_views
from infthor_eval.generation.simulator_jobs import JobProgress, OnProgress, ignore_progress
from infthor_eval.household.sequence_text import sequence_text
from infthor_eval.household.state_summary import state_summaries
from infthor_eval.storage.background import Background
from infthor_eval.thor.actions import text_of
from infthor_eval.thor.drawn_pictures import DrawnPictures
from infthor_eval.thor.grounding import Grounding
from infthor_eval.thor.recorded import MissingObjectError, translate
from infthor_eval.thor.recorder import Recorder
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator, SimulatorMark
from infthor_eval.thor.view import SimulatorView


class Refusal(msgspec.Struct):
    """An action that the simulator refused."""

    step: int
    action: str
    error: str


class Overlap(msgspec.Struct):
    """Overlap (IoU) of an object's rendered and recorded box, at the frame before the action."""

    step: int
    action: str
    type: str
    iou: float


class ReplayReport(msgspec.Struct):
    """Report of one replay (`replay.json`).

    Attributes:
        traj_id: id of the trajectory.
        digest: hash of its JSON, by which a later run recognises it.
        floor_plan: scene of the trajectory.
        frames: number of frames of each action that moves the agent or its camera.
        accepted: numbers of accepted actions by name.
        refusals: refused actions; at the first one the trajectory diverges.
        restore: parts of the initial scene that could not be restored, in words.
        overlaps: overlaps of the boxes in the recording.
        seconds: wall time.
    """

    traj_id: str
    digest: str
    floor_plan: str
    frames: int = 1
    accepted: dict[str, int] = msgspec.field(default_factory=dict)
    refusals: list[Refusal] = msgspec.field(default_factory=list)
    restore: list[str] = msgspec.field(default_factory=list)
    overlaps: list[Overlap] = msgspec.field(default_factory=list)
    seconds: float = 0.0

    @property
    def complete(self) -> bool:
        """True if no action was refused."""
        return not self.refusals


def replay(
    trajectory: Trajectory,
    simulator: Simulator,
    folder: Path,
    digest: str,
    frames: int = 1,
    on_progress: OnProgress = ignore_progress,
    *,
    needs_all: bool = False,
    drawn: DrawnPictures | None = None,
    beginning: "Beginning | None" = None,
) -> ReplayReport:
    """Run a trajectory and write its frames and logs into a folder.

    These are `img/`, `metadata.json`, `traj.txt`, `expert_log.json`, and `state_summary.json`: the
    room in words after each task and at the end, by index of the low-level action.

    Args:
        trajectory: a trajectory of ALFRED, of ∞-THOR, or ours.
        simulator: simulator to run it in; its scene is replaced.
        folder: an existing, empty folder.
        digest: hash of the trajectory's JSON, for the report.
        frames: number of frames of each action that moves the agent or its camera; other actions
            have one.
        on_progress: called after each action.
        needs_all: True to end where the scene cannot be restored, and at the first refusal; no log
            is written then.
        drawn: pictures of earlier replays, which are not drawn again.
        beginning: what is not replayed again.
    """
    report = ReplayReport(trajectory.traj_id, digest, trajectory.scene.floor_plan, frames)
    further = (lambda: drawn.arguments) if drawn is not None else dict[str, Any]
    start = None if beginning is None else beginning.start
    actions = ActionReplay(simulator, trajectory, report, on_progress, further, start)
    if needs_all and report.restore:
        return report
    (folder / "img").mkdir()
    with PngWriter(folder / "img") as frame_files, Background("log") as entries:
        steps = () if beginning is None else beginning.steps
        run = _Run(simulator, actions, Recorder(frame_files, drawn, steps), entries, frames)
        todo: Sequence[tuple[int, LowAction]] = list(enumerate(trajectory.plan.low_actions))
        if beginning is None:
            run.record(simulator.view)
        else:
            todo = run.go_on(beginning, todo, frame_files)
        for index, low in todo:
            run.act(index, low)
            if needs_all and report.refusals:
                return report
    _write_logs(trajectory, run.recorder.steps, folder)
    return report


def _write_logs(trajectory: Trajectory, steps: list[Step], folder: Path) -> None:
    write_steps(folder, steps)
    (folder / "traj.txt").write_text(sequence_text(trajectory, steps) + "\n")
    images = [{"low_idx": step.step, "image_name": step.img_filename} for step in steps]
    (folder / "expert_log.json").write_bytes(msgspec.json.encode({"images": images}) + b"\n")
    ends = {part.low_pddl_idx[1] - 1 for part in trajectory.sub_trajs}
    ends.add(len(trajectory.plan.low_actions) - 1)
    summaries = {str(index): text for index, text in state_summaries(steps, ends).items()}
    (folder / "state_summary.json").write_bytes(msgspec.json.encode(summaries) + b"\n")


@dataclass(frozen=True)
class Beginning:
    """What a replay has in common with an earlier one in the same simulator, with one frame a move.

    Attributes:
        start: the restored scene.
        steps: entries of the frames in common, from the first one on.
        images: folder of the files of these frames.
        mark: a state at or before the last of these frames.
        n_done: number of actions up to the mark.
    """

    start: SimulatorView
    steps: Sequence[Step]
    images: Path
    mark: SimulatorMark
    n_done: int


@dataclass(frozen=True)
class SetForm:
    """An NIEH set, as a form of what replays write (`replay_set.ReplayForm`).

    Attributes:
        frames: number of frames of each action that moves the agent or its camera.
    """

    frames: int = 1
    folder: str = "metadata"
    simulator_options: Mapping[str, Any] = field(default_factory=dict)
    report_type: type[ReplayReport] = ReplayReport

    def write(
        self,
        source: TrajectorySource,
        trajectory: Trajectory,
        simulator: Simulator,
        folder: Path,
        on_progress: OnProgress = ignore_progress,
    ) -> ReplayReport:
        """Write the frames and logs of a replay, and the trajectory as it came."""
        report = replay(trajectory, simulator, folder, source.digest, self.frames, on_progress)
        (folder / "traj_data.json").write_bytes(source.raw.strip() + b"\n")
        return report

    def require_same(self, report: ReplayReport, folder: Path) -> None:
        """Raise DataError if an earlier replay in a folder had other settings."""
        if report.frames != self.frames:
            raise DataError(
                f"{folder}: replayed with {report.frames} frames per move; remove it or choose "
                "another --out"
            )


def box_iou(one: tuple[int, int, int, int], other: tuple[int, int, int, int]) -> float:
    """Return the IoU of two boxes [xmin, ymin, xmax, ymax], both ends inclusive."""
    width = min(one[2], other[2]) - max(one[0], other[0]) + 1
    height = min(one[3], other[3]) - max(one[1], other[1]) + 1
    shared = max(width, 0) * max(height, 0)
    return shared / (_area(one) + _area(other) - shared)


def _area(box: tuple[int, int, int, int]) -> int:
    return (box[2] - box[0] + 1) * (box[3] - box[1] + 1)


class ActionReplay:
    """Executes the actions of a trajectory in a simulator, from its restored scene on.

    What is accepted, refused or not restored is added to the report; `further` returns arguments
    that each action has besides its own. With a `start` that was restored before, nothing is.
    """

    def __init__(
        self,
        simulator: Simulator,
        trajectory: Trajectory,
        report: ReplayReport,
        on_progress: OnProgress = ignore_progress,
        further: Callable[[], dict[str, Any]] = dict[str, Any],
        start: SimulatorView | None = None,
    ) -> None:
        if start is None:
            report.restore = restore(simulator, trajectory.scene).lines()
        self._simulator = simulator
        self._report = report
        self._on_progress = on_progress
        self._further = further
        self._n_actions = len(trajectory.plan.low_actions)
        self._grounding = Grounding(start or simulator.view)

    def execute(self, index: int, low: LowAction) -> tuple[str | None, str | None]:
        """Execute the action of an index.

        Returns:
            The acted-on object's id, and the reason if the action was refused.
        """
        target, error = self._call(index, low)
        name = low.api_action.action
        if error is None:
            self._report.accepted[name] = self._report.accepted.get(name, 0) + 1
        else:
            self._report.refusals.append(Refusal(index, _text_of(low), error))
        self._on_progress(self._progress(index))
        return target, error

    def _progress(self, index: int) -> JobProgress:
        refusals = self._report.refusals
        detail = ""
        if refusals:
            detail = f"{len(refusals)} action(s) refused, the last: {refusals[-1].error}"
        return JobProgress(self._report.traj_id, index + 1, self._n_actions, detail)

    def _call(self, index: int, low: LowAction) -> tuple[str | None, str | None]:
        before = self._simulator.view
        try:
            call = translate(low, self._grounding, before)
        except MissingObjectError as missing:
            return None, str(missing)
        target = call.get("objectId")
        self._compare_box(index, low, target, before)
        after = self._simulator.step(**call, **self._further())
        return target, None if after.success else after.error or "refused without a message"

    def _compare_box(
        self, index: int, low: LowAction, target: str | None, before: SimulatorView
    ) -> None:
        """Compare the recorded box of the object acted on with that in the frame before it."""
        recorded = low.discrete_action.box if low.discrete_action is not None else None
        if recorded is None or target is None or before.instances is None:
            return
        instance = before.instances.get(target)
        iou = 0.0 if instance is None else box_iou(recorded, instance.box)
        object_type = before.objects[target].object_type
        self._report.overlaps.append(
            Overlap(index, low.api_action.action, object_type, round(iou, 4))
        )


class _Run:
    """The recording of one replay, whose entries are made while the simulator goes on."""

    def __init__(
        self,
        simulator: Simulator,
        actions: ActionReplay,
        recorder: Recorder,
        entries: Background,
        frames: int,
    ) -> None:
        self._simulator = simulator
        self._actions = actions
        self._entries = entries
        self._frames = frames
        self.recorder = recorder

    def go_on(
        self, beginning: Beginning, actions: Sequence[tuple[int, LowAction]], images: PngWriter
    ) -> Sequence[tuple[int, LowAction]]:
        """Take over a beginning and its frames; return the actions after it."""
        for step in beginning.steps:
            images.link(beginning.images / step.img_filename, images.folder / step.img_filename)
        n_common = len(beginning.steps) - 1
        self._simulator.rewind(beginning.mark, exactly=True)
        for index, low in actions[beginning.n_done : n_common]:
            self._actions.execute(index, low)
        return actions[n_common:]

    def act(self, index: int, low: LowAction) -> None:
        before = self._simulator.view
        target, error = self._actions.execute(index, low)
        after = self._simulator.view.agent
        for view in intermediate_views(self._simulator, before.agent, after, self._frames):
            self.record(view, step=index, high_idx=low.high_idx)
        putting = low.api_action.action == "PutObject"
        self.record(
            self._simulator.view,
            step=index,
            action=_text_of(low),
            error=error,
            high_idx=low.high_idx,
            target=next(iter(before.inventory), None) if putting else target,
            receptacle=target if putting else None,
        )

    def record(self, view: SimulatorView, **entry: Any) -> None:
        self.recorder.draw(view)
        self._entries.run(self.recorder.record, view, **entry)


def _text_of(low: LowAction) -> str:
    api = low.api_action
    return str(text_of(api.action, api.object_id, api.receptacle_id))
