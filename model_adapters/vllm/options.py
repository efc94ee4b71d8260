"""Options of models that vLLM runs; docs/engines.md lists the corresponding arguments of vLLM.

To add an option of models in vLLM: a field here, its effect in `arguments.py`, its line in
`docs/engines.md`.
"""

from dataclasses import dataclass, fields
from typing import Annotated, Any, ClassVar

from msgspec import Meta

from infthor_eval.settings import Setting
from model_adapters.options.checkpoints import (
    CheckpointReading,
    CheckpointSource,
    ImageBackend,
    ModelOptions,
    Threads,
)
from model_adapters.options.families import PixelLimits
from model_adapters.options.policies import ActionOptions, FrameCrop

_LAUNCHED = "external_launcher"
_Gpus = Annotated[int, Meta(ge=1, le=1024)]
_Number = Annotated[int, Meta(ge=1, le=2**31 - 1)]
_Few = Annotated[int, Meta(ge=1, le=2**20)]
_Gib = Annotated[float, Meta(ge=0, le=2**20)]


@dataclass(frozen=True, kw_only=True)
class Throughput:
    """How vLLM stores long contexts and divides the work on them; all under vLLM's names, its own
    choice where None."""

    max_num_seqs: Annotated[
        _Few | None, Setting(help="Most requests that run at the same time.")
    ] = None
    max_num_batched_tokens: Annotated[
        _Number | None,
        Setting(
            help="Most tokens of a step: the size of the chunks in which long prompts are encoded, "
            "and of the cache of encoded frames."
        ),
    ] = None
    enable_chunked_prefill: Annotated[
        bool | None,
        Setting(help="Encode long prompts in chunks, between which other requests are decoded."),
    ] = None
    block_size: Annotated[
        _Few | None,
        Setting(
            help="Tokens of a block of keys and values, of which the prefix cache shares whole "
            "ones."
        ),
    ] = None
    kv_cache_dtype: Annotated[
        str | None,
        Setting(help="Type of keys and values (fp8 halves their memory and changes replies)."),
    ] = None
    kv_offloading_size: Annotated[
        _Gib | None,
        Setting(help="CPU memory for keys and values that do not fit on the GPU, in GiB."),
    ] = None
    decode_context_parallel_size: Annotated[
        _Gpus | None,
        Setting(help="GPUs that split the keys and values of each context while decoding."),
    ] = None
    prefill_context_parallel_size: Annotated[
        _Gpus | None, Setting(help="GPUs that split each prompt while it is encoded.")
    ] = None
    mm_encoder_tp_mode: Annotated[
        str | None,
        Setting(
            help="weights splits the vision tower over the GPUs, data splits the frames.",
            choices=("weights", "data"),
        ),
    ] = None
    mm_encoder_attn_backend: Annotated[
        str | None, Setting(help="Name of the vision tower's attention kernel.")
    ] = None

    def throughput(self) -> dict[str, Any]:
        """Return what is chosen, by vLLM's names."""
        chosen = {field.name: getattr(self, field.name) for field in fields(Throughput)}
        return {name: value for name, value in chosen.items() if value is not None}


@dataclass(frozen=True, kw_only=True)
class EngineOptions(Throughput, ModelOptions):
    """Options of vLLM for models and policies.

    `switches` are the options that are to save time or memory and to change no reply.
    """

    switches: ClassVar[tuple[str, ...]] = (
        *(field.name for field in fields(Throughput)),
        "prefix_caching",
        "mm_processor_cache_gb",
    )

    dtype: Annotated[
        str,
        Setting(
            help="Type of the weights; auto for the checkpoint's (vLLM converts float32 to "
            "float16).",
            choices=("auto", "bfloat16", "float16", "float32"),
        ),
    ] = "auto"
    max_model_len: Annotated[
        _Number | None,
        Setting(help="Most tokens of context and reply together; default: the checkpoint's limit."),
    ] = None
    tensor_parallel_size: Annotated[_Gpus, Setting(help="GPUs that split each layer.")] = 1
    pipeline_parallel_size: Annotated[
        _Gpus,
        Setting(help="GPUs, or groups of GPUs, that split the layers among them."),
    ] = 1
    data_parallel_size: Annotated[
        _Gpus,
        Setting(
            help=f"Copies of the model; above 1 only with distributed_executor_backend={_LAUNCHED}."
        ),
    ] = 1
    distributed_executor_backend: Annotated[
        str | None,
        Setting(help=f"mp, ray, uni or {_LAUNCHED}; default: vLLM's choice."),
    ] = None
    gpu_memory_utilization: Annotated[
        float,
        Meta(gt=0, le=1),
        Setting(help="Fraction of a GPU's memory that vLLM uses."),
    ] = 0.9
    enforce_eager: Annotated[
        bool,
        Setting(help="Run without CUDA graphs, which is slower and needs less memory."),
    ] = False
    quantization: Annotated[
        str | None,
        Setting(
            help="vLLM's name of a method (fp8, awq, bitsandbytes, ...); default: the "
            "checkpoint's own."
        ),
    ] = None
    prefix_caching: Annotated[
        bool,
        Setting(help="Cache keys and values for requests with a common prefix."),
    ] = True
    mm_processor_cache_gb: Annotated[
        _Gib | None,
        Setting(help="Memory for processed frames, in GiB; default: vLLM's."),
    ] = None
    seed: Annotated[
        int,
        Meta(ge=0, le=2**32 - 1),
        Setting(help="Seed of the engine; each request has its own in addition."),
    ] = 0
    threads: Annotated[
        Threads | None,
        Setting(
            help="Processor threads of vLLM on a CPU; default: those of OMP_NUM_THREADS, else all."
        ),
    ] = None

    def __post_init__(self) -> None:
        """Raise `ValueError` for values that vLLM would refuse only after minutes of loading."""
        if self.data_parallel_size > 1 and self.distributed_executor_backend != _LAUNCHED:
            raise ValueError(
                f"data_parallel_size={self.data_parallel_size} needs "
                f"distributed_executor_backend={_LAUNCHED} in vLLM; use --workers "
                f"{self.data_parallel_size} instead, with a model in each"
            )
        super().__post_init__()


@dataclass(frozen=True, kw_only=True)
class VllmOptions(EngineOptions, CheckpointReading):
    """Options of a model that answers in conversations."""

    switches: ClassVar[tuple[str, ...]] = (*EngineOptions.switches, "encoder_cache_tokens")

    frame_size: Annotated[
        int,
        Meta(ge=1, le=100_000),
        Setting(
            help="Width and height in pixels of the largest frame, for which vLLM reserves memory."
        ),
    ] = 300
    max_frames: Annotated[
        _Number | None,
        Setting(help="Most frames of a request; default: as many as fit into max_model_len."),
    ] = None
    image_backend: ImageBackend = "pil"
    encoder_cache_tokens: Annotated[
        _Number | None,
        Setting(
            help="Tokens of encoded frames that are kept for other requests, beside "
            "gpu_memory_utilization; default: as many as max_num_batched_tokens."
        ),
    ] = None

    def encoder_cache(self) -> dict[str, int]:
        """Return the size of the cache of encoded frames, if it is chosen."""
        tokens = self.encoder_cache_tokens
        return {} if tokens is None else {"encoder_cache_tokens": tokens}


@dataclass(frozen=True, kw_only=True)
class PixelVllmOptions(PixelLimits, VllmOptions):
    """Options of `qwen2.5-vl@vllm`."""


@dataclass(frozen=True, kw_only=True)
class OpenVLAOnVllmOptions(FrameCrop, CheckpointSource, EngineOptions, ActionOptions):
    """Options of `openvla@vllm`."""
