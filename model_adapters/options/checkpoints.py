"""Options of every transformers model."""

import importlib.util
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from msgspec import Meta

from infthor_eval.quantities import Count, Total
from infthor_eval.settings import Setting
from model_adapters.options.attention import POSITIONS, UNITS, parse_attention

_ATTENTION = ("eager", "sdpa", "flex_attention", "flash_attention_2", "flash_attention_3")
# Implementation to the module that has it, and the package to install for it.
_PACKAGES = {
    "flash_attention_2": ("flash_attn", "flash-attn"),
    "flash_attention_3": ("flash_attn_interface", "flash-attn-3"),
}
# Defaults of chunk_tokens: a GPU waits for the calls of smaller ones (benchmarks/gpu_h100.md).
_CHUNK, _CHUNK_ON_GPU = 1024, 4096
_ROPES = ("dynamic", "linear", "longrope", "longrope-scaled", "yarn")

Threads = Annotated[int, Meta(ge=1, le=1024)]
ImageBackend = Annotated[
    str,
    Setting(
        help="What resizes frames; torchvision makes slightly other pixels.",
        choices=("pil", "torchvision"),
    ),
]


def parse_rope(text: str) -> tuple[str, float]:
    """Return type and factor of a context extension `TYPE:FACTOR`.

    Raises:
        ValueError: the text has another form, or the factor extends nothing.
    """
    rope_type, _, number = text.partition(":")
    try:
        factor = float(number)
    except ValueError:
        factor = 0.0
    if rope_type not in _ROPES or not 1 < factor < 1000:
        raise ValueError(
            f"rope={text} is not TYPE:FACTOR with TYPE one of {', '.join(_ROPES)} and FACTOR above "
            "1"
        )
    return rope_type, factor


@dataclass(frozen=True, kw_only=True)
class ModelOptions:
    """Base of options that are checked together; `parse` checks each by itself."""

    def __post_init__(self) -> None:
        """Raise `ValueError` for values that contradict each other; each class calls the next."""


@dataclass(frozen=True, kw_only=True)
class Placement(ModelOptions):
    """Device, type and kernels of a network."""

    dtype: Annotated[
        str, Setting(help="Type of the weights, by torch's name; auto for the checkpoint's.")
    ] = "auto"
    device: Annotated[
        str, Setting(help="cpu, cuda, cuda:1, ..., or auto for a GPU if there is one.")
    ] = "auto"
    attn_implementation: Annotated[
        str,
        Setting(
            help=f"{', '.join(_ATTENTION)}; with sdpa, text models that cap scores (Gemma 2) have "
            "eager."
        ),
    ] = "sdpa"
    threads: Annotated[
        Threads | None,
        Setting(help="Torch threads of this model's computations on the CPU; default: torch's."),
    ] = None

    def __post_init__(self) -> None:
        """Refuse attention that transformers does not know, or would run from the hub."""
        name = self.attn_implementation
        if "/" in name and not getattr(self, "trust_remote_code", False):
            raise ValueError(
                f"attn_implementation={name} is code on the hub, which runs with "
                "trust_remote_code=true"
            )
        if "/" not in name and name not in _ATTENTION:
            raise ValueError(
                f"attn_implementation={name} is not known; there are {', '.join(_ATTENTION)}"
            )
        module, package = _PACKAGES.get(name, ("", ""))
        if module and importlib.util.find_spec(module) is None:
            raise ValueError(f"attn_implementation={name} needs the package {package}; use sdpa")
        super().__post_init__()


@dataclass(frozen=True, kw_only=True)
class Reading(ModelOptions):
    """Form and length of a model's prompts, and what is kept of its replies, on any engine."""

    prompt: Annotated[
        str,
        Setting(
            help="chat renders conversations by the checkpoint's chat template; plain concatenates "
            "the texts and frames of all turns, without roles.",
            choices=("chat", "plain"),
        ),
    ] = "chat"
    rope: Annotated[
        str | None,
        Setting(
            help="Context extension TYPE:FACTOR (yarn:4, linear:2, dynamic:4, longrope:8, "
            "longrope-scaled:8) instead of the checkpoint's RoPE."
        ),
    ] = None
    margins: Annotated[
        bool,
        Setting(
            help="Record the ids of a reply's tokens, and how near a tie each was, for "
            "`infthor-eval explain`."
        ),
    ] = False

    def image_settings(self) -> dict[str, Any]:
        """Return the image processor settings that differ from the checkpoint's; some families
        override this."""
        return {}

    def __post_init__(self) -> None:
        if self.rope is not None:
            parse_rope(self.rope)
        super().__post_init__()


@dataclass(frozen=True, kw_only=True)
class FrameScaling(ModelOptions):
    """What is made of a frame before the vision encoder, by transformers' code."""

    image_backend: ImageBackend = "pil"
    image_splitting: Annotated[
        bool | None,
        Setting(
            help="Cut frames into crops beside the whole frame, for processors that can; default: "
            "the checkpoint's setting."
        ),
    ] = None

    def __post_init__(self) -> None:
        if self.image_backend == "torchvision" and importlib.util.find_spec("torchvision") is None:
            raise ValueError(
                "image_backend=torchvision needs the package torchvision: pip install torchvision"
            )
        super().__post_init__()


@dataclass(frozen=True, kw_only=True)
class CheckpointSource:
    """Source of a checkpoint, on any engine."""

    pretrained: Annotated[
        str,
        Setting(
            help="Checkpoint: a folder, a hub id, or a folder of a hub's repository "
            "(owner/name/folder)."
        ),
    ]
    revision: Annotated[
        str | None, Setting(help="Branch, tag or commit on the hub; default: its default branch.")
    ] = None


@dataclass(frozen=True, kw_only=True)
class CheckpointReading(CheckpointSource, Reading):
    """A checkpoint and the prompts for it, on any engine."""

    trust_remote_code: Annotated[bool, Setting(help="Run code that comes with the checkpoint.")] = (
        False
    )


@dataclass(frozen=True, kw_only=True)
class HfOptions(Reading, Placement):
    """Inference by transformers.

    `switches` are the options that are to save time or memory and to change no reply.
    """

    switches: ClassVar[tuple[str, ...]] = (
        "attn_implementation",
        "share_prefix",
        "chunk_tokens",
        "batch_size",
        "kv_offload",
    )

    share_prefix: Annotated[
        bool,
        Setting(
            help="Encode the common prefix of two prompts once; false encodes every prompt as a "
            "whole."
        ),
    ] = True
    chunk_tokens: Annotated[
        Total | None,
        Setting(
            help="Most tokens encoded in one forward pass; default: "
            f"{_CHUNK} on a CPU, {_CHUNK_ON_GPU} on a GPU."
        ),
    ] = None
    # They read the prefix's keys and values together, and a reply can differ by rounding with what
    # is answered beside it.
    batch_size: Annotated[
        Total, Setting(help="Most continuations of one prefix that are answered together.")
    ] = 64
    kv_offload: Annotated[
        bool,
        Setting(
            help="Keep keys and values in CPU memory; slower, for contexts that do not fit on the "
            "GPU."
        ),
    ] = False
    attention: Annotated[
        str | None,
        Setting(
            help="Which earlier tokens each one sees: sinks:N+window:N, window:N, "
            "vertical-slash:SHARE or block-sparse:N; default: all (docs/engines.md)."
        ),
    ] = None
    positions: Annotated[
        str | None,
        Setting(
            help="With sinks, where those out of the window seem to be: as far as the window is "
            f"long, right before it in the cache, or where they are; default: {POSITIONS[0]}.",
            choices=POSITIONS,
        ),
    ] = None
    attention_unit: Annotated[
        str | None,
        Setting(
            help=f"What attention sees or does not see as a whole; default: {UNITS[0]}.",
            choices=UNITS,
        ),
    ] = None
    feature_cache_mb: Annotated[
        Count, Setting(help="Memory for vision features of earlier frames, in MiB.")
    ] = 128
    encoded_mb: Annotated[
        Count,
        Setting(
            help="Memory for keys and values of trajectories that memories of the cache are cut "
            "from, in MiB."
        ),
    ] = 4096
    frame_threads: Annotated[
        Annotated[int, Meta(ge=0, le=1024)] | None,
        Setting(
            help="Threads that read and scale frames ahead of the model; 0 for none; default: the "
            "process's share of processors, at most 8."
        ),
    ] = None
    frames_ahead_mb: Annotated[
        Count, Setting(help="Memory for frames that are ready before the model, in MiB.")
    ] = 256
    max_tokens: Annotated[
        Count | None, Setting(help="Context limit instead of the checkpoint's; 0 for none.")
    ] = None

    def __post_init__(self) -> None:
        shape = None if self.attention is None else parse_attention(self.attention)
        if shape is not None and not self.share_prefix:
            raise ValueError("attention needs share_prefix=true")
        if self.positions is not None and not getattr(shape, "sinks", 0):
            raise ValueError("positions needs attention=sinks:N+window:N; leave it out")
        if self.attention_unit is not None and shape is None:
            raise ValueError("attention_unit needs attention; leave it out")
        super().__post_init__()

    def attention_identity(self) -> dict[str, Any]:
        """Return what of sparse attention decides replies; nothing without it."""
        if self.attention is None:
            return {}
        has_sinks = getattr(parse_attention(self.attention), "sinks", 0)
        positions = {"positions": self.positions or POSITIONS[0]} if has_sinks else {}
        unit = self.attention_unit or UNITS[0]
        return {"attention": {"shape": self.attention, "unit": unit, **positions}}

    def chunk_size(self, device_type: str) -> int:
        """Return most tokens of one forward pass on a device, by torch's name of its type."""
        if self.chunk_tokens is not None:
            return self.chunk_tokens
        return _CHUNK if device_type == "cpu" else _CHUNK_ON_GPU


@dataclass(frozen=True, kw_only=True)
class CheckpointOptions(HfOptions, CheckpointReading):
    """A checkpoint, and inference with it by transformers."""

    device_map: Annotated[
        str | None,
        Setting(help="Transformers' device map (auto, balanced, ...) instead of one device."),
    ] = None
    quantization: Annotated[
        str | None,
        Setting(
            help="Weights of 4 or 8 bits by bitsandbytes; default: the checkpoint's own.",
            choices=("bnb4", "bnb8"),
        ),
    ] = None
