"""Options of policies whose weights are loaded here."""

from dataclasses import dataclass

from model_adapters.hf.options import Placement

__all__ = ["ActionOptions", "CheckpointPolicyOptions", "PolicyOptions"]

_ENSEMBLES = ("none", "exp")


@dataclass(frozen=True, kw_only=True)
class ActionOptions:
    """How a policy acts, whichever engine runs it; it always takes the likeliest tokens.

    Attributes:
        unnorm_key: the dataset whose robot's metres and radians the actions are scaled to; the checkpoint's own where
            it knows only one.
        constrained: choose among tokens that mean an action; false chooses among all and clips, as the originals do.
        ensemble: none gives out chunks as they are; exp averages overlapping chunks and gives out one step a call.
        execute: how many steps of a chunk are given out; all where None.
    """

    unnorm_key: str | None = None
    constrained: bool = True
    ensemble: str = "none"
    execute: int | None = None

    def __post_init__(self) -> None:
        """Refuse what does not go together."""
        if self.ensemble not in _ENSEMBLES:
            raise ValueError(f"ensemble={self.ensemble} is not {' or '.join(_ENSEMBLES)}")
        if self.execute is not None and self.execute < 1:
            raise ValueError(f"execute={self.execute} gives out no step; it is 1 or more")
        if self.ensemble == "exp" and self.execute not in (None, 1):
            raise ValueError(f"execute={self.execute} does not go with ensemble=exp, which gives out one step a call")


@dataclass(frozen=True, kw_only=True)
class PolicyOptions(ActionOptions, Placement):
    """How a policy is run here."""

    def __post_init__(self) -> None:
        super().__post_init__()
        Placement.__post_init__(self)


@dataclass(frozen=True, kw_only=True)
class CheckpointPolicyOptions(PolicyOptions):
    """Where a policy's checkpoint comes from.

    Attributes:
        pretrained: hub id or folder.
        revision: branch, tag or commit on the hub; the default branch where None.
    """

    pretrained: str
    revision: str | None = None
