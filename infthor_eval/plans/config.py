"""The config of a run of plans."""

from typing import Any

import msgspec

from infthor_eval.episodes.config import EpisodesConfig, EpisodeTaskConfig
from infthor_eval.formats.object_ids import Words


class PlansTaskConfig(EpisodeTaskConfig, frozen=True, kw_only=True, omit_defaults=True):
    """The config of a task; imported counts have no rewards, and nothing but the defaults.

    Attributes:
        rewards: rules of rewards, as `RewardRules.document` has them.
        words: words in which plans and actions name objects.
        history: how much of the true history the agent is given.
        recall: identity of a memory of one's own choice; None for none.
        protocol: how final tasks are run.
        after_failure: what follows a plan that was not completed.
        decoding: how replies are decoded, as `Decoding.document` has it.
        sources: digests of the logs that counts were imported from.
    """

    rewards: dict[str, Any] | None
    words: Words | None = None
    history: str | None = None
    recall: dict[str, Any] | None = None
    protocol: str | None = None
    after_failure: str | None = None
    decoding: dict[str, Any] = msgspec.field(default_factory=dict)
    sources: dict[str, Any] = msgspec.field(default_factory=dict)


class PlansConfig(EpisodesConfig[PlansTaskConfig], frozen=True, kw_only=True, omit_defaults=True):
    """The config of a run; `constrained`: replies are restricted to actions that can be written."""

    constrained: bool = False
