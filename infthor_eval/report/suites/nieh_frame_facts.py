"""What the log of a trajectory says of its frames, in the words of the page."""

from collections.abc import Sequence
from pathlib import Path

from infthor_eval.formats.step_log import LoggedPose, Step, read_steps
from infthor_eval.report.web.samples import FrameFacts

__all__ = ["read_frame_facts"]


def read_frame_facts(folder: Path) -> Sequence[FrameFacts]:
    """Return what the log of a trajectory's folder says of each frame, in time order.

    Raises:
        DataError: the log cannot be read.
    """
    return [_facts(step) for step in sorted(read_steps(folder), key=lambda step: step.img_idx)]


def _facts(step: Step) -> FrameFacts:
    refusal = "" if step.success else step.error or "refused by the simulator"
    return FrameFacts(
        step=step.step,
        action=step.action or "",
        error=refusal,
        objects=tuple(step.object_log.visible),
        held=tuple(step.object_log.inven_obj),
        pose="" if step.pose is None else _pose(step.pose),
    )


def _pose(pose: LoggedPose) -> str:
    return (
        f"x {pose.x:.2f} m, z {pose.z:.2f} m; turned {pose.rotation:.0f}°, camera "
        f"{pose.horizon:.0f}° down"
    )
