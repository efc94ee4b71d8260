"""The config of a run of manipulation."""

from infthor_eval.episodes.config import EpisodesConfig, EpisodeTaskConfig
from infthor_eval.manipulation.kinds import ManipulationKind, PutCriterion
from infthor_eval.quantities import Amount


class ArmTaskConfig(EpisodeTaskConfig, frozen=True, kw_only=True, omit_defaults=True):
    """The config of a task.

    Attributes:
        radius: radius of the hand's sphere, metres.
        instruction: instruction of a policy by the command line; None for the task's own.
        stand: where the agent stands at the start, see `Stand`; None in runs of older versions.
        hand: height of its arm at the start, see `Hand`; likewise.
        closing: when a policy's hand closes, see `Closing`; likewise.
        rules: number of the rules of success, see `SUCCESS_RULES`.
        put_criterion: when a put succeeds, see `PutCriterion`.
        cameras: cameras of a policy with episodes; None for the agent's alone.
        state: whether such a policy is told of its hand.
    """

    kind: ManipulationKind
    radius: Amount
    instruction: str | None = None
    stand: str | None = None
    hand: str | None = None
    closing: str | None = None
    rules: int = 1
    put_criterion: PutCriterion = PutCriterion.AT_REST
    cameras: str | None = None
    state: bool = False


class ManipulationConfig(
    EpisodesConfig[ArmTaskConfig], frozen=True, kw_only=True, omit_defaults=True
):
    """The config of a run."""
