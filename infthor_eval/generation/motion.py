"""Intermediate frames between two poses of the agent, for replays with several per action."""

from collections.abc import Iterator

from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.view import AgentPose, SimulatorView, Vector, teleport_call


def smoothstep(share: float) -> float:
    """Return the share of a motion that is done at a share of its time, if it starts and ends
    slowly (3a² - 2a³, as in the published renderer)."""
    return share * share * (3.0 - 2.0 * share)


def intermediate_views(
    simulator: Simulator, start: AgentPose, end: AgentPose, frames: int, *, eased: bool = False
) -> Iterator[SimulatorView]:
    """Yield the states at poses between two; the agent returns to the second pose.

    Args:
        simulator: simulator with the agent at `end`.
        start: pose before the action.
        end: pose after the action.
        frames: number of frames of the action, including that at `end`.
        eased: True for poses by `smoothstep`; else they are evenly spaced.

    Yields:
        `frames` - 1 states, or none if the agent did not move.
    """
    if start == end:
        return
    for number in range(1, frames):
        share = smoothstep(number / frames) if eased else number / frames
        yield simulator.query(**teleport_call(_interpolate(start, end, share)))
    if frames > 1:
        simulator.query(**teleport_call(end))


def _interpolate(start: AgentPose, end: AgentPose, share: float) -> AgentPose:
    turn = (end.rotation - start.rotation + 180.0) % 360.0 - 180.0  # the shorter way round
    one = start.position
    other = end.position
    return AgentPose(
        Vector(
            one.x + share * (other.x - one.x),
            one.y + share * (other.y - one.y),
            one.z + share * (other.z - one.z),
        ),
        (start.rotation + share * turn) % 360.0,
        start.horizon + share * (end.horizon - start.horizon),
        end.standing,
    )
