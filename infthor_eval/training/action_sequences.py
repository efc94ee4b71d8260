"""Training sequences for acting: a trajectory's true history, cut into windows of whole plans.

Every window has the form of an agent's truncated history (`--history last:N`): the current goal,
the frame at the beginning of the window, then plans.
"""

from collections.abc import Iterator, Sequence

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.step_log import Step
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.plans.actors.habits import expert_texts
from infthor_eval.plans.history.segments import PlanSegment, restart_at, segment_parts
from infthor_eval.plans.plan import plans_of, tasks_of
from infthor_eval.training.encoding import Encoder, SkippedSequence, TrainingSequence
from model_adapters.hf.prompting.prompt import n_tokens


def recorded_segments(
    trajectory: Trajectory, steps: Sequence[Step], frames: Sequence[FrameRef], words: Words
) -> list[PlanSegment]:
    """Return a trajectory's true history from its replay, one entry per plan.

    Args:
        trajectory: trajectory with goals and plans.
        steps: steps of the replayed log in time order; of several frames of one action the last is
            used.
        frames: frame of each step.
        words: words of plans and actions.
    """
    plans = plans_of(trajectory, words)
    tasks = tasks_of(trajectory)
    before: FrameRef | None = None
    after: dict[int, FrameRef] = {}
    for step, frame in zip(steps, frames, strict=True):
        if step.action is None:
            before = before or frame
        else:
            after[step.step] = frame
    if before is None:
        raise DataError(
            f"trajectory {trajectory.traj_id}: no frame before the first action; replay it again"
        )
    segments: list[PlanSegment] = []
    for plan in plans:
        missing = next((number for number in range(*plan.low) if number not in after), None)
        if missing is not None:
            raise DataError(
                f"trajectory {trajectory.traj_id}: no frame of action {missing}; replay it again"
            )
        begins = not segments or plans[plan.index - 1].task != plan.task
        goal = tasks[plan.task].text if begins else None
        texts = expert_texts(trajectory, plan, words)
        frames = [after[number] for number in range(*plan.low)]
        segments.append(
            PlanSegment(
                plan.text, goal, before, tuple(zip(texts, frames, strict=True)), plan.in_task
            )
        )
        before = segments[-1].steps[-1][1]
    return segments


def windows(
    encoder: Encoder, name: str, segments: Sequence[PlanSegment], limit: int
) -> Iterator[TrainingSequence | SkippedSequence]:
    """Cut a history into sequences of as many whole plans as fit; every plan is in one of them.

    Args:
        encoder: builds the sequences.
        name: name of the trajectory.
        segments: history of the trajectory.
        limit: most tokens of a sequence, frames expanded; plans that exceed it alone are skipped
            items.
    """
    first = 0
    while first < len(segments):
        end = _window_end(encoder, segments, first, limit)
        if end == first:
            yield SkippedSequence(f"{name}, plan {first + 1}", f"longer than {limit} tokens")
            first += 1
            continue
        numbers = f"plan {end}" if end == first + 1 else f"plans {first + 1} to {end}"
        parts = segment_parts(restart_at(segments, first, end))
        yield encoder.actions(f"{name}, {numbers}", parts)
        first = end


def _window_end(encoder: Encoder, segments: Sequence[PlanSegment], first: int, limit: int) -> int:
    """Return the end of the largest window that fits.

    It is found by doubling and bisection, because counting tokens needs a rendering of the whole
    window.
    """

    def fits(end: int) -> bool:
        return n_tokens(encoder.pieces(segment_parts(restart_at(segments, first, end)))) <= limit

    fitting = first
    stride = 1
    while fitting + stride <= len(segments) and fits(fitting + stride):
        fitting = fitting + stride
        stride = 2 * stride
    while stride:
        if fitting + stride <= len(segments) and fits(fitting + stride):
            fitting += stride
        stride //= 2
    return fitting
