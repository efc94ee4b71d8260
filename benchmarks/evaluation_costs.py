"""What requests to a model take: seconds, memory and GPUs.

`published_evaluation.py` adds them up; docs/cost.md has the formulae. Units are tokens, seconds, bytes and FLOP; a
machine's numbers are of one GPU.
"""

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

from infthor_eval.errors import UsageError

_BYTES = 2  # of a bfloat16


@dataclass(frozen=True)
class Shape:
    """A model, as its checkpoint's config has it.

    Attributes:
        name: as on the command line.
        parameters: all of them.
        layers: of the language model.
        heads: for queries, in each layer.
        kv_heads: for keys and values, in each layer.
        head_size: numbers in each.
        frame_tokens: that one frame of 300x300 takes.
        limit: tokens of context without an extension.
        vision_flop: of one frame in the vision tower.
        frame_seconds: to read and scale one frame on the CPU.
    """

    name: str
    parameters: float
    layers: int
    heads: int
    kv_heads: int
    head_size: int
    frame_tokens: int
    limit: int
    vision_flop: float
    frame_seconds: float

    @property
    def weights(self) -> float:
        """Bytes of the weights."""
        return self.parameters * _BYTES

    @property
    def kv_bytes(self) -> int:
        """Bytes of keys and values that one token of context takes."""
        return 2 * self.layers * self.kv_heads * self.head_size * _BYTES

    @property
    def pair_flop(self) -> int:
        """FLOP of attention for one token that looks at one other."""
        return 4 * self.layers * self.heads * self.head_size


# Tokens per frame as measured with the processors (Qwen2.5-VL: 121 and 2 markers), limits and shapes from the
# checkpoints' configs, parameters as in Table 4. Vision: 2 FLOP for each parameter of the tower and patch of a frame of
# 300x300. Reading and scaling a frame was measured on one CPU core, with the processors at the checkpoints' sizes.
MODELS = (
    Shape(
        name="llava-onevision",
        parameters=8.03e9,
        layers=28,
        heads=28,
        kv_heads=4,
        head_size=128,
        frame_tokens=1485,
        limit=32_768,
        vision_flop=2 * 0.43e9 * 1458,
        frame_seconds=0.026,
    ),
    Shape(
        name="qwen2.5-vl",
        parameters=8.29e9,
        layers=28,
        heads=28,
        kv_heads=4,
        head_size=128,
        frame_tokens=123,
        limit=128_000,
        vision_flop=2 * 0.63e9 * 484,
        frame_seconds=0.008,
    ),
    Shape(
        name="deepseek-vl",
        parameters=7.34e9,
        layers=30,
        heads=32,
        kv_heads=32,
        head_size=128,
        frame_tokens=576,
        limit=16_384,
        vision_flop=2 * 0.3e9 * 576 + 0.97e12,
        frame_seconds=0.082,
    ),
    Shape(
        name="pixtral",
        parameters=12.68e9,
        layers=40,
        heads=32,
        kv_heads=8,
        head_size=128,
        frame_tokens=380,
        limit=131_072,
        vision_flop=2 * 0.4e9 * 361,
        frame_seconds=0.008,
    ),
)


@dataclass(frozen=True)
class Machine:
    """A machine and what is bought with it; see the options of `published_evaluation.py` for where numbers come from.

    Attributes:
        tflops: reached in matrix products, in 1e12 FLOP/s.
        attention_tflops: reached in attention.
        bandwidth: of a GPU's memory as reached, bytes/s.
        step_overhead: seconds that a decoded token takes beside reading weights and cache.
        memory: of one GPU, bytes.
        usable: share of it that weights, cache and what attention needs may take.
        gpus_per_node: most GPUs that one worker can have.
        attention: sdpa or flash_attention_2, for memory.
        chunk_tokens: encoded in one pass.
        parallel: layers (device_map: one GPU of a worker computes at a time) or tensor (all do).
        tensor_efficiency: share of the speed of several GPUs that tensor parallelism reaches.
        load_seconds: until a worker has its model.
    """

    tflops: float
    attention_tflops: float
    bandwidth: float
    step_overhead: float
    memory: float
    usable: float
    gpus_per_node: int
    attention: str
    chunk_tokens: int
    parallel: str
    tensor_efficiency: float
    load_seconds: float

    def speed(self, n_gpus: int) -> float:
        """Of a worker with so many GPUs, against one with one."""
        return 1.0 if n_gpus == 1 or self.parallel == "layers" else n_gpus * self.tensor_efficiency


@dataclass(frozen=True)
class Rates:
    """Of one model on one GPU.

    Attributes:
        token: seconds to encode a token, without attention to others.
        pair: seconds of attention for one token that looks at one other.
        step: seconds to decode a token on a short context.
        cached_token: seconds by which one more token of context lengthens that.
    """

    token: float
    pair: float
    step: float
    cached_token: float


@dataclass(frozen=True)
class Request:
    """One reply.

    Attributes:
        context: tokens that it is made from.
        cached: how many of them the request before left encoded.
        reply: tokens of the reply.
    """

    context: int
    cached: int
    reply: int


def estimated(shape: Shape, machine: Machine) -> Rates:
    """Rates from what a model has to compute and read; the GPU waits while frames are read."""
    frame = shape.vision_flop / (machine.tflops * 1e12) + shape.frame_seconds
    return Rates(
        token=2 * shape.parameters / (machine.tflops * 1e12) + frame / shape.frame_tokens,
        pair=shape.pair_flop / (machine.attention_tflops * 1e12),
        step=machine.step_overhead + shape.weights / machine.bandwidth,
        cached_token=shape.kv_bytes / machine.bandwidth,
    )


def measured_prefill(rates: Rates, short: tuple[int, float], long: tuple[int, float]) -> Rates:
    """Rates with those of encoding from two measurements: tokens of a context, and tokens/s on it.

    Encoding n tokens takes token * n + pair * n^2 / 2.

    Raises:
        UsageError: no such rates give both measurements.
    """
    (n_short, slow_short), (n_long, slow_long) = ((n, 1 / rate) for n, rate in (short, long))
    if n_long <= n_short or slow_long < slow_short:
        raise UsageError(f"of {short} and {long}, the longer context must come second and be the slower one")
    pair = 2 * (slow_long - slow_short) / (n_long - n_short)
    token = slow_short - pair * n_short / 2
    if token <= 0:
        raise UsageError(f"{short} and {long} leave no time for anything but attention; measure a shorter context")
    return Rates(token, pair, rates.step, rates.cached_token)


def seconds(request: Request, rates: Rates, reuse: bool = True) -> float:
    """What one GPU takes for a reply, encoding what is not there yet, or everything."""
    cached = request.cached if reuse else 0
    new = request.context - cached
    decoding = request.reply * (rates.step + rates.cached_token * request.context)
    return rates.token * new + rates.pair * (new * cached + new * new / 2) + decoding


def context_bytes(shape: Shape, machine: Machine) -> float:
    """Bytes for each token of context: keys and values, and what attention makes on its way for a layer and a chunk."""
    if machine.attention != "sdpa":
        return shape.kv_bytes
    # A mask makes SDPA repeat keys and values for every head; the mask itself is of 1 byte, and of 2 in the kernel.
    repeated = 2 * shape.heads * shape.head_size * _BYTES if shape.heads > shape.kv_heads else 0
    return shape.kv_bytes + repeated + 3 * max(machine.chunk_tokens, shape.frame_tokens)


def largest_context(shape: Shape, machine: Machine, n_gpus: int) -> int:
    """Tokens of context that so many GPUs have the memory for beside the weights."""
    room = n_gpus * machine.memory * machine.usable - shape.weights
    return max(0, int(room / context_bytes(shape, machine)))


def gpus_for(shape: Shape, machine: Machine, context: int) -> int | None:
    """GPUs that a worker needs for contexts of so many tokens, a power of two; None where a node has too few."""
    n_gpus = 1
    while n_gpus <= machine.gpus_per_node:
        if context <= largest_context(shape, machine, n_gpus):
            return n_gpus
        n_gpus *= 2
    return None


def makespan(jobs: Sequence[float], n_workers: int) -> float:
    """Seconds until all jobs are done, the longest first and each to the worker that is free first."""
    free = [0.0] * n_workers
    for job in sorted(jobs, reverse=True):
        heapq.heapreplace(free, free[0] + job)
    return max(free)
