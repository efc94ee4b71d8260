"""Options of policies in this process and behind a server; default checkpoints are in
`built_in.py`."""

import re
from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from infthor_eval.quantities import Total
from infthor_eval.settings import Setting
from model_adapters.addresses import WEBSOCKET, act_url, server_address
from model_adapters.options.checkpoints import CheckpointSource, ModelOptions, Placement

DEFAULT_INTRINSICS = "default"
# How servers code the gripper: the numbers for closed and for open.
GRIPPERS = {
    "binary_close_positive": (1.0, -1.0),
    "binary_close_negative": (-1.0, 1.0),
    "continuous_01": (0.0, 1.0),
    "binary_close_01": (1.0, 0.0),
}
STATES = ("eef_pos3_euler3_gripper2", "eef_pos3_axisangle3_gripper2", "eef_pos3_quat4_gripper1")
_Scale = Annotated[float, Meta(gt=0, le=100)]
_PATH = re.compile(r"(/[\w.~-]+)+")
_Execute = Annotated[
    Total | None, Setting(help="Steps of a chunk that are returned; default: all.", of="steps")
]


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
class ActionOptions(ModelOptions):
    """Decoding and use of a policy's actions, on any engine; decoding is always greedy."""

    unnorm_key: Annotated[
        str | None,
        Setting(
            help="Dataset whose statistics scale actions to metres and radians; default: the "
            "checkpoint's, if it has only one."
        ),
    ] = None
    constrained: Annotated[
        bool,
        Setting(
            help="Decode among action tokens only; false decodes among all tokens and clips, as "
            "the originals do."
        ),
    ] = True
    ensemble: Annotated[
        str,
        Setting(
            help="none returns chunks as they are; exp averages overlapping chunks and returns one "
            "step a call.",
            choices=("none", "exp"),
        ),
    ] = "none"
    execute: _Execute = None

    def __post_init__(self) -> None:
        if self.ensemble == "exp" and self.execute not in (None, 1):
            raise ValueError(
                f"execute={self.execute} contradicts ensemble=exp, which returns one step a call"
            )
        super().__post_init__()


@dataclass(frozen=True, kw_only=True)
class PolicyOptions(ActionOptions, Placement):
    """Options of a policy whose network runs in this process."""


@dataclass(frozen=True, kw_only=True)
class CheckpointPolicyOptions(CheckpointSource, PolicyOptions):
    """Options of a policy with a checkpoint, whose network runs in this process."""


@dataclass(frozen=True, kw_only=True)
class FrameCrop:
    """What OpenVLA gets of a frame, on any engine."""

    center_crop: Annotated[
        bool,
        Setting(
            help="Show 90 % of the area, for checkpoints fine-tuned on random crops (for LIBERO)."
        ),
    ] = False


@dataclass(frozen=True, kw_only=True)
class OpenVLAOptions(FrameCrop, CheckpointPolicyOptions):
    """Options of `openvla`."""


@dataclass(frozen=True, kw_only=True)
class OpenVLATinyOptions(FrameCrop, PolicyOptions):
    """Options of `openvla-tiny`, which has no checkpoint."""


@dataclass(frozen=True, kw_only=True)
class SpatialVLAOptions(PolicyOptions):
    """Options of SpatialVLA: only these implementations attend to the prefix in both directions."""

    attn_implementation: Annotated[
        str,
        Setting(
            help="eager caps attention scores, as Gemma 2 was trained; sdpa is faster and does "
            "not.",
            choices=("eager", "sdpa"),
        ),
    ] = "eager"
    ensemble: Annotated[
        str,
        Setting(
            help="exp, as in the published evaluations in SimplerEnv, averages overlapping chunks; "
            "none returns them as they are.",
            choices=("none", "exp"),
        ),
    ] = "exp"
    intrinsics: Annotated[
        str,
        Setting(
            help="default for the camera of the checkpoint's dataset, or thor:DEGREES for a "
            "simulator's camera with this vertical field of view."
        ),
    ] = DEFAULT_INTRINSICS

    def __post_init__(self) -> None:
        parse_field_of_view(self.intrinsics)
        super().__post_init__()


@dataclass(frozen=True, kw_only=True)
class SpatialVLACheckpointOptions(CheckpointSource, SpatialVLAOptions):
    """Options of `spatialvla`."""


@dataclass(frozen=True, kw_only=True)
class ServedPolicyOptions:
    """Options of a policy behind a server, whatever it speaks."""

    execute: _Execute = None
    timeout_s: Annotated[
        float, Meta(gt=0, le=86_400), Setting(help="Limit for a whole reply, in seconds.")
    ] = 60.0
    retries: Annotated[
        int,
        Meta(ge=0, le=10),
        Setting(help="Repetitions of a request after a failed connection."),
    ] = 3


@dataclass(frozen=True, kw_only=True)
class VlaHttpOptions(ServedPolicyOptions):
    """Options of a policy behind a server."""

    url: Annotated[str, Setting(help="Address of the server, without /act.")] = (
        "http://localhost:8000"
    )
    unnorm_key: Annotated[
        str | None, Setting(help="Dataset key sent with every request; default: none is sent.")
    ] = None
    image: Annotated[
        str,
        Setting(
            help="json_numpy sends frames in base 64, as OpenVLA's server expects; list sends "
            "nested lists of numbers.",
            choices=("json_numpy", "list"),
        ),
    ] = "json_numpy"
    reset: Annotated[
        str | None,
        Setting(
            help="Path that each episode's instruction is posted to when it begins, such as "
            "/reset; default: the server is told of none."
        ),
    ] = None

    def __post_init__(self) -> None:
        act_url(self.url)
        if self.reset is not None and not _PATH.fullmatch(self.reset):
            raise ValueError("reset is no path without a query; write /reset")


@dataclass(frozen=True, kw_only=True)
class SocketPolicyOptions(ServedPolicyOptions):
    """Options of a policy behind a server of websockets, which are those of `vla-eval`."""

    url: Annotated[str, Setting(help="Address of the server.")] = "ws://localhost:8000"
    translation_scale: Annotated[
        _Scale | None,
        Setting(
            help="What 1 of a movement is; default: 0.05 if declared from -1 to 1 or not at all, "
            "else 1.",
            of="metres",
        ),
    ] = None
    rotation_scale: Annotated[
        _Scale | None,
        Setting(
            help="What 1 of an angle is; default: 0.5 if declared from -1 to 1 or not at all, "
            "else 1.",
            of="radians",
        ),
    ] = None
    gripper: Annotated[
        str | None,
        Setting(
            help="Format of the gripper; default: as declared, else binary_close_positive.",
            choices=tuple(GRIPPERS),
        ),
    ] = None
    padded: Annotated[
        bool, Setting(help="Steps have further numbers at their end, which mean nothing.")
    ] = False
    state_format: Annotated[
        str | None,
        Setting(
            help=f"Format of the hand; default: as declared, else {STATES[0]}.", choices=STATES
        ),
    ] = None
    deterministic: Annotated[
        bool, Setting(help="Equal episodes get equal actions, which `check adapter` then requires.")
    ] = False
    max_in_flight: Annotated[
        int, Meta(ge=1, le=64), Setting(help="Episodes at the same time, a connection each.")
    ] = 1

    def __post_init__(self) -> None:
        server_address("url", self.url, WEBSOCKET)


@dataclass(frozen=True, kw_only=True)
class OpenPiOptions(SocketPolicyOptions):
    """Options of `openpi`; keys and state are those of its models for LIBERO."""

    image_key: Annotated[str, Setting(help="Key of the view.")] = "observation/image"
    wrist_key: Annotated[str, Setting(help="Key of the view from the wrist.")] = (
        "observation/wrist_image"
    )
    state_key: Annotated[str, Setting(help="Key of the hand's state.")] = "observation/state"
    prompt_key: Annotated[str, Setting(help="Key of the instruction.")] = "prompt"
    state_format: Annotated[str, Setting(help="Format of the hand.", choices=STATES)] = STATES[1]
