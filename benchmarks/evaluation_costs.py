"""Seconds, memory and GPUs that requests to a model take.

`published_evaluation.py` sums them up; benchmarks/cost.md has the formulae. Units are tokens,
seconds, bytes and FLOP. The numbers of a machine are per GPU.
"""

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

from infthor_eval.errors import UsageError

_BYTES = 2  # per bfloat16 number


@dataclass(frozen=True)
class Shape:
    """The shape of a model, as in its checkpoint's config.

    Attributes:
        name: name on the command line.
        parameters: number of all parameters.
        layers: layers of the language model.
        heads: query heads per layer.
        kv_heads: key and value heads per layer.
        head_size: size of a head.
        frame_tokens: tokens of one frame of 300x300.
        limit: maximum context without extension, tokens.
        vision_flop: FLOP of one frame in the vision tower.
        frame_seconds: CPU seconds to read and scale one frame.
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
        """Bytes of keys and values per token of context."""
        return 2 * self.layers * self.kv_heads * self.head_size * _BYTES

    @property
    def pair_flop(self) -> int:
        """FLOP of attention for one pair of tokens."""
        return 4 * self.layers * self.heads * self.head_size


# Tokens per frame are measured with the processors (Qwen2.5-VL: 121 and 2 markers). Limits and
# shapes are those of the checkpoints' configs, parameters those of Table 4. Vision takes 2 FLOP per
# parameter of the tower and patch of a frame of 300x300. Reading and scaling a frame is measured on
# one CPU core, with the processors at the checkpoints' sizes.
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
    """A machine; the options of `published_evaluation.py` say where the numbers come from.

    Attributes:
        tflops: achieved rate of matrix products, 1e12 FLOP/s.
        attention_tflops: achieved rate of attention, 1e12 FLOP/s.
        bandwidth: achieved memory bandwidth of a GPU, bytes/s.
        step_overhead: seconds per decoded token beside reading weights and cache.
        memory: memory of a GPU, bytes.
        usable: share of the memory for weights, cache and attention.
        gpus_per_node: maximum number of GPUs of one worker.
        attention: sdpa or flash_attention_2, which differ in memory.
        chunk_tokens: tokens encoded in one pass.
        parallel: layers (device_map: one GPU of a worker computes at a time) or tensor (all
            compute).
        tensor_efficiency: share of the speed of several GPUs that tensor parallelism achieves.
        load_seconds: seconds until a worker has loaded its model.
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
        """Return the speed of a worker with this number of GPUs, relative to one GPU."""
        return 1.0 if n_gpus == 1 or self.parallel == "layers" else n_gpus * self.tensor_efficiency


@dataclass(frozen=True)
class Rates:
    """Rates of one model on one GPU.

    Attributes:
        token: seconds to encode a token, without attention.
        pair: seconds of attention per pair of tokens.
        step: seconds to decode a token on a short context.
        cached_token: additional seconds of a decoding step per token of context.
    """

    token: float
    pair: float
    step: float
    cached_token: float


@dataclass(frozen=True)
class Request:
    """One request for a reply.

    Attributes:
        context: tokens of the context.
        cached: tokens of it that the request before has encoded.
        reply: tokens of the reply.
    """

    context: int
    cached: int
    reply: int


def estimate_rates(shape: Shape, machine: Machine) -> Rates:
    """Estimate rates from what a model computes and reads, if the GPU waits while frames are
    read."""
    frame = shape.vision_flop / (machine.tflops * 1e12) + shape.frame_seconds
    return Rates(
        token=2 * shape.parameters / (machine.tflops * 1e12) + frame / shape.frame_tokens,
        pair=shape.pair_flop / (machine.attention_tflops * 1e12),
        step=machine.step_overhead + shape.weights / machine.bandwidth,
        cached_token=shape.kv_bytes / machine.bandwidth,
    )


def rates_from_prefill(rates: Rates, short: tuple[int, float], long: tuple[int, float]) -> Rates:
    """Return rates with encoding rates from two measurements: tokens of a context, and tokens/s on
    it.

    Encoding n tokens takes token * n + pair * n^2 / 2.

    Raises:
        UsageError: no encoding rates explain both measurements.
    """
    (n_short, slow_short), (n_long, slow_long) = ((n, 1 / rate) for n, rate in (short, long))
    if n_long <= n_short or slow_long < slow_short:
        raise UsageError(
            f"of {short} and {long}, the longer context must come second and be the slower one"
        )
    pair = 2 * (slow_long - slow_short) / (n_long - n_short)
    token = slow_short - pair * n_short / 2
    if token <= 0:
        raise UsageError(
            f"{short} and {long} leave no time for anything but attention; measure a shorter "
            "context"
        )
    return Rates(token, pair, rates.step, rates.cached_token)


def seconds(request: Request, rates: Rates, reuse: bool = True) -> float:
    """Return the seconds of a request on one GPU, encoding only what is not cached, or
    everything."""
    cached = request.cached if reuse else 0
    new = request.context - cached
    decoding = request.reply * (rates.step + rates.cached_token * request.context)
    return rates.token * new + rates.pair * (new * cached + new * new / 2) + decoding


def context_bytes(shape: Shape, machine: Machine) -> float:
    """Return the bytes per token of context: keys, values, and the temporary memory of
    attention."""
    if machine.attention != "sdpa":
        return shape.kv_bytes
    # With a mask, SDPA repeats keys and values for every head; the mask itself has 1 byte, and 2 in
    # the kernel.
    repeated = 2 * shape.heads * shape.head_size * _BYTES if shape.heads > shape.kv_heads else 0
    return shape.kv_bytes + repeated + 3 * max(machine.chunk_tokens, shape.frame_tokens)


def largest_context(shape: Shape, machine: Machine, n_gpus: int) -> int:
    """Return the maximum context for which this number of GPUs has the memory beside the weights,
    tokens."""
    room = n_gpus * machine.memory * machine.usable - shape.weights
    return max(0, int(room / context_bytes(shape, machine)))


def gpus_for(shape: Shape, machine: Machine, context: int) -> int | None:
    """Return the number of GPUs, a power of two, that a context requires, or None if a node has too
    few."""
    n_gpus = 1
    while n_gpus <= machine.gpus_per_node:
        if context <= largest_context(shape, machine, n_gpus):
            return n_gpus
        n_gpus *= 2
    return None


def makespan(jobs: Sequence[float], n_workers: int) -> float:
    """Return the seconds until all jobs are done, the longest first, each by the first free
    worker."""
    free = [0.0] * n_workers
    for job in sorted(jobs, reverse=True):
        heapq.heapreplace(free, free[0] + job)
    return max(free)
