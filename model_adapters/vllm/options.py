"""Options of models that vLLM runs; docs/engines.md lists the corresponding arguments of vLLM.

To add an option of models in vLLM: a field here, its effect in `arguments.py`, its line in
`docs/engines.md`.
"""

from dataclasses import dataclass, fields
from typing import Any, ClassVar

from model_adapters.options.checkpoints import CheckpointReading, CheckpointSource
from model_adapters.options.families import (
    HfVlmOptions,
    LlavaOnevisionOptions,
    PixelLimits,
    PixtralOptions,
    Qwen25VLOptions,
)
from model_adapters.options.policies import ActionOptions, FrameCrop, OpenVLAOptions

_DTYPES = ("auto", "bfloat16", "float16", "float32")
_RANGES = {
    "max_model_len": (1, 2**31 - 1),
    "tensor_parallel_size": (1, 1024),
    "pipeline_parallel_size": (1, 1024),
    "data_parallel_size": (1, 1024),
    "mm_processor_cache_gb": (0, 2**20),
    "seed": (0, 2**32 - 1),
    "frame_size": (1, 100_000),
    "max_frames": (1, 2**31 - 1),
    "threads": (1, 1024),
    "max_num_seqs": (1, 2**20),
    "max_num_batched_tokens": (1, 2**31 - 1),
    "encoder_cache_tokens": (1, 2**31 - 1),
    "block_size": (1, 2**20),
    "kv_offloading_size": (0, 2**20),
    "decode_context_parallel_size": (1, 1024),
    "prefill_context_parallel_size": (1, 1024),
}
_ENCODER_SPLITS = ("weights", "data")
_LAUNCHED = "external_launcher"
_IMAGE_BACKENDS = ("pil", "torchvision")


@dataclass(frozen=True, kw_only=True)
class Throughput:
    """How vLLM stores long contexts and divides the work on them; all under vLLM's names, its own
    choice where None.

    Attributes:
        max_num_seqs: most requests that run at the same time.
        max_num_batched_tokens: most tokens of a step: the size of the chunks in which long prompts
            are encoded, and of the cache of encoded frames.
        enable_chunked_prefill: encode long prompts in chunks, between which other requests are
            decoded.
        block_size: tokens of a block of keys and values, of which the prefix cache shares whole
            ones.
        kv_cache_dtype: type of keys and values (fp8 halves their memory and changes replies).
        kv_offloading_size: CPU memory for keys and values that do not fit on the GPU, in GiB.
        decode_context_parallel_size: GPUs that split the keys and values of each context while
            decoding.
        prefill_context_parallel_size: GPUs that split each prompt while it is encoded.
        mm_encoder_tp_mode: weights splits the vision tower over the GPUs, data splits the frames.
        mm_encoder_attn_backend: vLLM's name of the vision tower's attention kernel.
    """

    max_num_seqs: int | None = None
    max_num_batched_tokens: int | None = None
    enable_chunked_prefill: bool | None = None
    block_size: int | None = None
    kv_cache_dtype: str | None = None
    kv_offloading_size: float | None = None
    decode_context_parallel_size: int | None = None
    prefill_context_parallel_size: int | None = None
    mm_encoder_tp_mode: str | None = None
    mm_encoder_attn_backend: str | None = None

    def throughput(self) -> dict[str, Any]:
        """Return what is chosen, by vLLM's names."""
        chosen = {field.name: getattr(self, field.name) for field in fields(Throughput)}
        return {name: value for name, value in chosen.items() if value is not None}


@dataclass(frozen=True, kw_only=True)
class EngineOptions(Throughput):
    """Options of vLLM for models and policies.

    Attributes:
        dtype: type of the weights: bfloat16, float16, float32, or auto for that of the checkpoint
            (vLLM converts float32 to float16).
        max_model_len: most tokens of context and reply together; the checkpoint's limit where None.
        tensor_parallel_size: GPUs that split each layer.
        pipeline_parallel_size: GPUs, or groups of GPUs, that split the layers among them.
        data_parallel_size: copies of the model; above 1 only with
            distributed_executor_backend=external_launcher.
        distributed_executor_backend: mp, ray, uni or external_launcher; vLLM's own choice where
            None.
        gpu_memory_utilization: fraction of a GPU's memory that vLLM uses, above 0 and at most 1.
        enforce_eager: run without CUDA graphs, which is slower and needs less memory.
        quantization: vLLM's name of a method (fp8, awq, bitsandbytes, ...); the checkpoint's own
            where None.
        prefix_caching: cache keys and values for requests with a common prefix.
        mm_processor_cache_gb: memory for processed frames, in GiB; vLLM's default where None.
        seed: seed of the engine; each request has its own in addition.
        threads: processor threads of vLLM on a CPU; those of OMP_NUM_THREADS, else all, where None.

    `switches` are the options that are to save time or memory and to change no reply.
    """

    switches: ClassVar[tuple[str, ...]] = (
        *(field.name for field in fields(Throughput)),
        "prefix_caching",
        "mm_processor_cache_gb",
    )

    dtype: str = "auto"
    max_model_len: int | None = None
    tensor_parallel_size: int = 1
    pipeline_parallel_size: int = 1
    data_parallel_size: int = 1
    distributed_executor_backend: str | None = None
    gpu_memory_utilization: float = 0.9
    enforce_eager: bool = False
    quantization: str | None = None
    prefix_caching: bool = True
    mm_processor_cache_gb: float | None = None
    seed: int = 0
    threads: int | None = None

    def __post_init__(self) -> None:
        """Raise `ValueError` for values that vLLM would refuse only after minutes of loading."""
        if self.dtype not in _DTYPES:
            raise ValueError(f"dtype={self.dtype} is not {', '.join(_DTYPES)}")
        if not 0 < self.gpu_memory_utilization <= 1:
            raise ValueError(
                f"gpu_memory_utilization={self.gpu_memory_utilization} is not above 0 and at most 1"
            )
        for name, (least, most) in _RANGES.items():
            value = getattr(self, name, None)
            if value is not None and not least <= value <= most:
                raise ValueError(f"{name}={value} is not from {least:,} to {most:,}")
        if self.mm_encoder_tp_mode not in (None, *_ENCODER_SPLITS):
            raise ValueError(
                f"mm_encoder_tp_mode={self.mm_encoder_tp_mode} is not "
                f"{' or '.join(_ENCODER_SPLITS)}"
            )
        if self.data_parallel_size > 1 and self.distributed_executor_backend != _LAUNCHED:
            raise ValueError(
                f"data_parallel_size={self.data_parallel_size} needs "
                f"distributed_executor_backend={_LAUNCHED} in vLLM; use --workers "
                f"{self.data_parallel_size} instead, with a model in each"
            )


@dataclass(frozen=True, kw_only=True)
class VllmOptions(EngineOptions, CheckpointReading):
    """Options of a model that answers in conversations.

    Attributes:
        frame_size: width and height in pixels of the largest frame, for which vLLM reserves memory.
        max_frames: most frames of a request; as many as fit into max_model_len where None.
        image_backend: what resizes frames: pil, as with transformers here, or torchvision, vLLM's
            own choice. They make slightly different pixels.
        encoder_cache_tokens: tokens of encoded frames that are kept for other requests, beside
            gpu_memory_utilization; as many as max_num_batched_tokens where None.
    """

    switches: ClassVar[tuple[str, ...]] = (*EngineOptions.switches, "encoder_cache_tokens")

    frame_size: int = 300
    max_frames: int | None = None
    image_backend: str = "pil"
    encoder_cache_tokens: int | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        CheckpointReading.__post_init__(self)
        if self.image_backend not in _IMAGE_BACKENDS:
            raise ValueError(
                f"image_backend={self.image_backend} is not {' or '.join(_IMAGE_BACKENDS)}"
            )

    def encoder_cache(self) -> dict[str, int]:
        """Return the size of the cache of encoded frames, if it is chosen."""
        tokens = self.encoder_cache_tokens
        return {} if tokens is None else {"encoder_cache_tokens": tokens}


@dataclass(frozen=True, kw_only=True)
class VllmPolicyOptions(CheckpointSource, EngineOptions, ActionOptions):
    """Options of a policy."""

    def __post_init__(self) -> None:
        super().__post_init__()
        ActionOptions.__post_init__(self)


@dataclass(frozen=True, kw_only=True)
class Qwen25VLOnVllmOptions(PixelLimits, VllmOptions):
    """Options of `qwen2.5-vl@vllm`."""

    pretrained: str = Qwen25VLOptions.pretrained


@dataclass(frozen=True, kw_only=True)
class LlavaOnevisionOnVllmOptions(VllmOptions):
    """Options of `llava-onevision@vllm`."""

    pretrained: str = LlavaOnevisionOptions.pretrained


@dataclass(frozen=True, kw_only=True)
class PixtralOnVllmOptions(VllmOptions):
    """Options of `pixtral@vllm`."""

    pretrained: str = PixtralOptions.pretrained


@dataclass(frozen=True, kw_only=True)
class HfVlmOnVllmOptions(VllmOptions):
    """Options of `hf-vlm@vllm`."""

    pretrained: str = HfVlmOptions.pretrained


@dataclass(frozen=True, kw_only=True)
class OpenVLAOnVllmOptions(FrameCrop, VllmPolicyOptions):
    """Options of `openvla@vllm`."""

    pretrained: str = OpenVLAOptions.pretrained
