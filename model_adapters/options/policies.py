"""Options of policies: those whose weights are loaded here, and those behind a server."""

from dataclasses import dataclass

from model_adapters.addresses import act_url
from model_adapters.options.checkpoints import Placement

__all__ = [
    "DEFAULT_INTRINSICS",
    "ActionOptions",
    "CheckpointPolicyOptions",
    "OpenVLAOptions",
    "PolicyOptions",
    "SpatialVLACheckpointOptions",
    "SpatialVLAOptions",
    "VlaHttpOptions",
    "parse_field_of_view",
]

DEFAULT_INTRINSICS = "default"
_ENSEMBLES = ("none", "exp")
_ATTENTION = ("eager", "sdpa")  # of SpatialVLA
_ENCODINGS = ("json_numpy", "list")


def parse_field_of_view(text: str) -> float | None:
    """The vertical field of view, in degrees, of `thor:DEGREES`; None for `default`.

    Raises:
        ValueError: it has another form, or no camera has such a field.
    """
    if text == DEFAULT_INTRINSICS:
        return None
    kind, _, number = text.partition(":")
    try:
        degrees = float(number)
    except ValueError:
        degrees = 0.0
    if kind != "thor" or not 0 < degrees < 180:
        raise ValueError(
            f"intrinsics={text} is not {DEFAULT_INTRINSICS} or thor:DEGREES, DEGREES the vertical field of view"
        )
    return degrees


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


@dataclass(frozen=True, kw_only=True)
class OpenVLAOptions(CheckpointPolicyOptions):
    """Options of `openvla`."""

    pretrained: str = "openvla/openvla-7b"


@dataclass(frozen=True, kw_only=True)
class SpatialVLAOptions(PolicyOptions):
    """What SpatialVLA takes beside the options of all policies.

    Attributes:
        attn_implementation: eager caps attention scores as Gemma 2 was trained; sdpa is faster and does not.
        ensemble: exp as in the published evaluations in SimplerEnv.
        intrinsics: default is the camera of the checkpoint's dataset; thor:DEGREES a simulator's with this vertical
            field of view.
    """

    attn_implementation: str = "eager"
    ensemble: str = "exp"
    intrinsics: str = DEFAULT_INTRINSICS

    def __post_init__(self) -> None:
        super().__post_init__()
        parse_field_of_view(self.intrinsics)
        if self.attn_implementation not in _ATTENTION:
            raise ValueError(
                f"attn_implementation={self.attn_implementation} cannot read the prefix in both directions; "
                f"use {' or '.join(_ATTENTION)}"
            )


@dataclass(frozen=True, kw_only=True)
class SpatialVLACheckpointOptions(SpatialVLAOptions, CheckpointPolicyOptions):
    """Options of `spatialvla`."""

    pretrained: str = "IPEC-COMMUNITY/spatialvla-4b-224-pt"


@dataclass(frozen=True, kw_only=True)
class VlaHttpOptions:
    """How a server is asked.

    Attributes:
        url: of the server; `/act` is put behind it.
        unnorm_key: sent with every request where it is given.
        image: json_numpy sends a frame in base 64, as OpenVLA's server expects; list as nested lists of numbers.
        execute: how many steps of a chunk are given out; all where None.
        timeout_s: for a reply.
        retries: how often a request is sent again where the connection failed.
    """

    url: str = "http://localhost:8000"
    unnorm_key: str | None = None
    image: str = "json_numpy"
    execute: int | None = None
    timeout_s: float = 60.0
    retries: int = 3

    def __post_init__(self) -> None:
        act_url(self.url)
        if self.image not in _ENCODINGS:
            raise ValueError(f"image={self.image} is not {' or '.join(_ENCODINGS)}")
        if self.execute is not None and self.execute < 1:
            raise ValueError(f"execute={self.execute} gives out no step; it is 1 or more")
        if not 0 < self.timeout_s <= 86_400 or not 0 <= self.retries <= 10:
            raise ValueError("timeout_s must be above 0 and at most a day, retries 0 to 10")
