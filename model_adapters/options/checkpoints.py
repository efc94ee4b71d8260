"""Options of every transformers model."""

import importlib.util
from dataclasses import dataclass
from typing import Any, ClassVar

_ATTENTION = ("eager", "sdpa", "flex_attention", "flash_attention_2", "flash_attention_3")
# Implementation to the module that has it, and the package to install for it.
_PACKAGES = {
    "flash_attention_2": ("flash_attn", "flash-attn"),
    "flash_attention_3": ("flash_attn_interface", "flash-attn-3"),
}
_LARGEST = 2**53  # largest value of an option; anything above is a typing error
_SIZES = ("chunk_tokens", "batch_size", "feature_cache_mb", "frames_ahead_mb", "max_tokens")
_MOST_THREADS = 1024
# Defaults of chunk_tokens: a GPU waits for the calls of smaller ones (benchmarks/gpu_h100.md).
_CHUNK, _CHUNK_ON_GPU = 1024, 4096
_IMAGE_BACKENDS = ("pil", "torchvision")
_PROMPTS = ("chat", "plain")
_ROPES = ("dynamic", "linear", "longrope", "longrope-scaled", "yarn")


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
class Placement:
    """Device, type and kernels of a network.

    Attributes:
        dtype: torch's name of the weights' type, or auto for that of the checkpoint.
        device: cpu, cuda, cuda:1, ..., or auto for a GPU if there is one.
        attn_implementation: sdpa, eager, flash_attention_2, ...; with sdpa, text models that cap
            scores (Gemma 2) have eager.
        threads: torch threads of this model's computations on the CPU; torch's default where None.
    """

    dtype: str = "auto"
    device: str = "auto"
    attn_implementation: str = "sdpa"
    threads: int | None = None

    def __post_init__(self) -> None:
        """Refuse attention that transformers does not know, or would run from the hub."""
        if self.threads is not None and not 1 <= self.threads <= _MOST_THREADS:
            raise ValueError(f"threads={self.threads} is not from 1 to {_MOST_THREADS}")
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


@dataclass(frozen=True, kw_only=True)
class Reading:
    """Form and length of a model's prompts, and what is kept of its replies, on any engine.

    Attributes:
        prompt: chat renders conversations by the checkpoint's chat template; plain concatenates the
            texts and frames of all turns, without roles.
        rope: context extension TYPE:FACTOR (yarn:4, linear:2, dynamic:4, longrope:8,
            longrope-scaled:8) instead of the checkpoint's RoPE.
        margins: record the ids of a reply's tokens, and how near a tie each was, for
            `infthor-eval explain`.
    """

    prompt: str = "chat"
    rope: str | None = None
    margins: bool = False

    def image_settings(self) -> dict[str, Any]:
        """Return the image processor settings that differ from the checkpoint's; some families
        override this."""
        return {}

    def __post_init__(self) -> None:
        if self.prompt not in _PROMPTS:
            raise ValueError(f"prompt={self.prompt} is not {' or '.join(_PROMPTS)}")
        if self.rope is not None:
            parse_rope(self.rope)


@dataclass(frozen=True, kw_only=True)
class FrameScaling:
    """What is made of a frame before the vision encoder, by transformers' code.

    Attributes:
        image_backend: what resizes frames: pil, or torchvision, which makes slightly other pixels.
        image_splitting: cut frames into crops beside the whole frame, for processors that can; the
            checkpoint's setting where None.
    """

    image_backend: str = "pil"
    image_splitting: bool | None = None

    def __post_init__(self) -> None:
        if self.image_backend not in _IMAGE_BACKENDS:
            raise ValueError(
                f"image_backend={self.image_backend} is not {' or '.join(_IMAGE_BACKENDS)}"
            )
        if self.image_backend == "torchvision" and importlib.util.find_spec("torchvision") is None:
            raise ValueError(
                "image_backend=torchvision needs the package torchvision: pip install torchvision"
            )


@dataclass(frozen=True, kw_only=True)
class CheckpointSource:
    """Source of a checkpoint, on any engine.

    Attributes:
        pretrained: folder, hub id, or a folder of a hub's repository (`owner/name/folder`).
        revision: branch, tag or commit on the hub; the default branch where None.
    """

    pretrained: str
    revision: str | None = None


@dataclass(frozen=True, kw_only=True)
class CheckpointReading(CheckpointSource, Reading):
    """A checkpoint and the prompts for it, on any engine.

    Attributes:
        trust_remote_code: run code that comes with the checkpoint.
    """

    trust_remote_code: bool = False


@dataclass(frozen=True, kw_only=True)
class HfOptions(Reading, Placement):
    """Inference by transformers.

    Attributes:
        share_prefix: encode the common prefix of two prompts once; false encodes every prompt as a
            whole.
        chunk_tokens: most tokens encoded in one forward pass; 1024 on a CPU and 4096 on a GPU where
            None.
        batch_size: most continuations of one prefix that are answered together. They read the
            prefix's keys and values together, and a reply can differ by rounding with what is
            answered beside it.
        kv_offload: keep keys and values in CPU memory; slower, for contexts that do not fit on the
            GPU.
        feature_cache_mb: memory for vision features of earlier frames, in MiB.
        frame_threads: threads that read and scale frames ahead of the model; 0 for none. The
            process's share of processors, at most 8, where None.
        frames_ahead_mb: memory for frames that are ready before the model, in MiB.
        max_tokens: context limit instead of the checkpoint's; 0 for none.

    `switches` are the options that are to save time or memory and to change no reply.
    """

    switches: ClassVar[tuple[str, ...]] = (
        "attn_implementation",
        "share_prefix",
        "chunk_tokens",
        "batch_size",
        "kv_offload",
    )

    share_prefix: bool = True
    chunk_tokens: int | None = None
    batch_size: int = 64
    kv_offload: bool = False
    feature_cache_mb: int = 128
    frame_threads: int | None = None
    frames_ahead_mb: int = 256
    max_tokens: int | None = None

    def __post_init__(self) -> None:
        if (
            (self.chunk_tokens is not None and self.chunk_tokens < 1)
            or self.batch_size < 1
            or self.feature_cache_mb < 0
            or self.frames_ahead_mb < 0
            or (self.max_tokens or 0) < 0
        ):
            raise ValueError(
                "chunk_tokens and batch_size must be positive, feature_cache_mb, frames_ahead_mb "
                "and max_tokens not negative"
            )
        for name in _SIZES:
            if (getattr(self, name) or 0) > _LARGEST:
                raise ValueError(f"{name} is above {_LARGEST}")
        if self.frame_threads is not None and not 0 <= self.frame_threads <= _MOST_THREADS:
            raise ValueError(f"frame_threads={self.frame_threads} is not from 0 to {_MOST_THREADS}")
        super().__post_init__()
        Placement.__post_init__(self)

    def chunk_size(self, device_type: str) -> int:
        """Return most tokens of one forward pass on a device, by torch's name of its type."""
        if self.chunk_tokens is not None:
            return self.chunk_tokens
        return _CHUNK if device_type == "cpu" else _CHUNK_ON_GPU


@dataclass(frozen=True, kw_only=True)
class CheckpointOptions(HfOptions, CheckpointReading):
    """A checkpoint, and inference with it by transformers.

    Attributes:
        device_map: transformers' device map (auto, balanced, ...) instead of one device.
        quantization: bnb4 or bnb8 for bitsandbytes with 4 or 8 bits per weight; none for the
            checkpoint's own.
    """

    device_map: str | None = None
    quantization: str | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.quantization not in (None, "bnb4", "bnb8"):
            raise ValueError(f"quantization={self.quantization} is not bnb4, bnb8 or none")
