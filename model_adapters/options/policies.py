"""Options of policies in this process and behind a server."""

from dataclasses import dataclass

from model_adapters.addresses import act_url
from model_adapters.options.checkpoints import CheckpointSource, Placement

DEFAULT_INTRINSICS = "default"
_ENSEMBLES = ("none", "exp")
_ATTENTION = ("eager", "sdpa")  # implementations that SpatialVLA supports
_ENCODINGS = ("json_numpy", "list")


def parse_field_of_view(text: str) -> float | None:
    """Return the vertical field of view in `thor:DEGREES`, in degrees, or None for `default`.

    Raises:
        ValueError: the text has another form, or the angle is out of range.
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
            f"intrinsics={text} is not {DEFAULT_INTRINSICS} or thor:DEGREES, DEGREES the vertical "
            "field of view"
        )
    return degrees


@dataclass(frozen=True, kw_only=True)
class ActionOptions:
    """Decoding and use of a policy's actions, on any engine; decoding is always greedy.

    Attributes:
        unnorm_key: dataset whose statistics scale actions to metres and radians; None if the
            checkpoint has only one.
        constrained: decode among action tokens only; false decodes among all tokens and clips, as
            the originals do.
        ensemble: none returns chunks as they are; exp averages overlapping chunks and returns one
            step a call.
        execute: steps of a chunk that are returned; all where None.
    """

    unnorm_key: str | None = None
    constrained: bool = True
    ensemble: str = "none"
    execute: int | None = None

    def __post_init__(self) -> None:
        if self.ensemble not in _ENSEMBLES:
            raise ValueError(f"ensemble={self.ensemble} is not {' or '.join(_ENSEMBLES)}")
        if self.execute is not None and self.execute < 1:
            raise ValueError(f"execute={self.execute} returns no step; use 1 or more")
        if self.ensemble == "exp" and self.execute not in (None, 1):
            raise ValueError(
                f"execute={self.execute} contradicts ensemble=exp, which returns one step a call"
            )


@dataclass(frozen=True, kw_only=True)
class PolicyOptions(ActionOptions, Placement):
    """Options of a policy whose network runs in this process."""

    def __post_init__(self) -> None:
        super().__post_init__()
        Placement.__post_init__(self)


@dataclass(frozen=True, kw_only=True)
class CheckpointPolicyOptions(CheckpointSource, PolicyOptions):
    """Options of a policy with a checkpoint, whose network runs in this process."""


@dataclass(frozen=True, kw_only=True)
class FrameCrop:
    """What OpenVLA gets of a frame, on any engine.

    Attributes:
        center_crop: 90 % of the area, for checkpoints fine-tuned on random crops (for LIBERO).
    """

    center_crop: bool = False


@dataclass(frozen=True, kw_only=True)
class OpenVLAOptions(FrameCrop, CheckpointPolicyOptions):
    """Options of `openvla`."""

    pretrained: str = "openvla/openvla-7b"


@dataclass(frozen=True, kw_only=True)
class SpatialVLAOptions(PolicyOptions):
    """Options of SpatialVLA.

    Attributes:
        attn_implementation: eager caps attention scores, as Gemma 2 was trained; sdpa is faster and
            does not.
        ensemble: exp as in the published evaluations in SimplerEnv.
        intrinsics: default for the camera of the checkpoint's dataset, or thor:DEGREES for a
            simulator's camera with this vertical field of view.
    """

    attn_implementation: str = "eager"
    ensemble: str = "exp"
    intrinsics: str = DEFAULT_INTRINSICS

    def __post_init__(self) -> None:
        super().__post_init__()
        parse_field_of_view(self.intrinsics)
        if self.attn_implementation not in _ATTENTION:
            raise ValueError(
                f"attn_implementation={self.attn_implementation} cannot attend to the prefix in "
                f"both directions; use {' or '.join(_ATTENTION)}"
            )


@dataclass(frozen=True, kw_only=True)
class SpatialVLACheckpointOptions(SpatialVLAOptions, CheckpointPolicyOptions):
    """Options of `spatialvla`."""

    pretrained: str = "IPEC-COMMUNITY/spatialvla-4b-224-pt"


@dataclass(frozen=True, kw_only=True)
class VlaHttpOptions:
    """Options of a policy behind a server.

    Attributes:
        url: address of the server, without `/act`.
        unnorm_key: dataset key sent with every request; not sent where None.
        image: json_numpy sends frames in base 64, as OpenVLA's server expects; list sends nested
            lists of numbers.
        execute: steps of a chunk that are returned; all where None.
        timeout_s: limit for a whole reply, in seconds.
        retries: repetitions of a request after a failed connection.
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
            raise ValueError(f"execute={self.execute} returns no step; use 1 or more")
        if not 0 < self.timeout_s <= 86_400 or not 0 <= self.retries <= 10:
            raise ValueError("timeout_s must be above 0 and at most a day, retries 0 to 10")
