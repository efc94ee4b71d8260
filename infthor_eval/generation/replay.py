"""Replaying one recorded trajectory to frames and a step log.

A refused action is logged with its message and the replay continues, as ALFRED's does. The log has
what really happened, so questions on it are still correct. The trajectory counts as diverged from
its first refused action on.
"""

from pathlib import Path

import msgspec

from infthor_eval.formats.step_log import write_steps
from infthor_eval.formats.trajectory import LowAction, Trajectory
from infthor_eval.generation.motion import intermediate_views
from infthor_eval.household.sequence_text import sequence_text
from infthor_eval.household.state_summary import state_summaries
from infthor_eval.thor.actions import text_of
from infthor_eval.thor.grounding import Grounding
from infthor_eval.thor.recorded import MissingObjectError, translate
from infthor_eval.thor.recorder import Recorder
from infthor_eval.thor.restore import restore
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import SimulatorView

__all__ = ["Overlap", "Refusal", "ReplayReport", "box_iou", "replay"]


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
    trajectory: Trajectory, simulator: Simulator, folder: Path, digest: str, frames: int = 1
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

    Raises:
        SimulatorError: the simulator fails, or has no such scene.
    """
    report = ReplayReport(trajectory.traj_id, digest, trajectory.scene.floor_plan, frames)
    restored = restore(simulator, trajectory.scene)
    report.restore = [f"no {name} here" for name in restored.dropped] + restored.refused
    (folder / "img").mkdir()
    run = _Run(simulator, report, folder / "img")
    for index, low in enumerate(trajectory.plan.low_actions):
        run.act(index, low)
    steps = run.recorder.steps
    write_steps(folder, steps)
    (folder / "traj.txt").write_text(sequence_text(trajectory, steps) + "\n")
    images = [{"low_idx": step.step, "image_name": step.img_filename} for step in steps]
    (folder / "expert_log.json").write_bytes(msgspec.json.encode({"images": images}) + b"\n")
    ends = {part.low_pddl_idx[1] - 1 for part in trajectory.sub_trajs}
    ends.add(len(trajectory.plan.low_actions) - 1)
    summaries = {str(index): text for index, text in state_summaries(steps, ends).items()}
    (folder / "state_summary.json").write_bytes(msgspec.json.encode(summaries) + b"\n")
    return report


def box_iou(one: tuple[int, int, int, int], other: tuple[int, int, int, int]) -> float:
    """Return the IoU of two boxes [xmin, ymin, xmax, ymax], both ends inclusive."""
    width = min(one[2], other[2]) - max(one[0], other[0]) + 1
    height = min(one[3], other[3]) - max(one[1], other[1]) + 1
    shared = max(width, 0) * max(height, 0)
    return shared / (_area(one) + _area(other) - shared)


def _area(box: tuple[int, int, int, int]) -> int:
    return (box[2] - box[0] + 1) * (box[3] - box[1] + 1)


class _Run:
    """One replay, from the restored scene on."""

    def __init__(self, simulator: Simulator, report: ReplayReport, images: Path) -> None:
        self._simulator = simulator
        self._report = report
        self.recorder = Recorder(images)
        self.recorder.record(simulator.view)
        self._grounding = Grounding(simulator.view)

    def act(self, index: int, low: LowAction) -> None:
        before = self._simulator.view
        api = low.api_action
        text = str(text_of(api.action, api.object_id, api.receptacle_id))
        target, error = self._call(index, low, before)
        if error is None:
            self._report.accepted[api.action] = self._report.accepted.get(api.action, 0) + 1
        else:
            self._report.refusals.append(Refusal(index, text, error))
        after = self._simulator.view.agent
        views = intermediate_views(self._simulator, before.agent, after, self._report.frames)
        for view in views:
            self.recorder.record(view, step=index, high_idx=low.high_idx)
        putting = api.action == "PutObject"
        step = self.recorder.record(
            self._simulator.view,
            step=index,
            action=text,
            high_idx=low.high_idx,
            target=next(iter(before.inventory), None) if putting else target,
            receptacle=target if putting else None,
        )
        # Set here, as an action that could not be called at all has no reply of the simulator.
        step.success = error is None
        step.error = error

    def _call(
        self, index: int, low: LowAction, before: SimulatorView
    ) -> tuple[str | None, str | None]:
        """Execute an action; returns the acted-on object's id, and the reason if it is refused."""
        try:
            call = translate(low, self._grounding, before)
        except MissingObjectError as missing:
            return None, str(missing)
        target = call.get("objectId")
        self._compare_box(index, low, target, before)
        after = self._simulator.step(**call)
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
