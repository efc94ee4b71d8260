"""Memories in the cache of the model under test: what is kept of a trajectory that it has encoded.

The frames before the current view are encoded, their keys and values are cut to the budget, and the
question is asked behind what is left (`model_adapters.hf.kept`). Memories of frames choose as those
that show frames do, so that both can be compared: cut after the whole was encoded, or encoded
alone. Of the others the method chooses tokens, so that no frame is recalled as a whole.
"""

from typing import ClassVar

from infthor_eval.memory.frames import Last, Nothing, Oracle, Random, Uniform
from infthor_eval.memory.protocol import MemoryCapabilities

_METHODS = "model_adapters.hf.kept.methods"
FRAMES = f"{_METHODS}:Frames"  # keeps the frames that the memory recalls


class KvWindow(Last):
    """Keys and values of the last frames before the current view."""

    capabilities: ClassVar[MemoryCapabilities] = MemoryCapabilities(cache=FRAMES)


class KvUniform(Uniform):
    """Keys and values of frames at even distances."""

    capabilities: ClassVar[MemoryCapabilities] = MemoryCapabilities(cache=FRAMES)


class KvRandom(Random):
    """Keys and values of frames drawn for each question."""

    capabilities: ClassVar[MemoryCapabilities] = MemoryCapabilities(cache=FRAMES)


class KvOracle(Oracle):
    """Keys and values of the clue frames, and of others drawn until there are as many."""

    capabilities: ClassVar[MemoryCapabilities] = MemoryCapabilities(privileged=True, cache=FRAMES)


class KvSinks(Nothing):
    """Keys and values of the first four tokens and the last ones (StreamingLLM)."""

    capabilities: ClassVar[MemoryCapabilities] = MemoryCapabilities(cache=f"{_METHODS}:Sinks")


class KvNorm(Nothing):
    """Keys of the smallest norms, by head, with their values."""

    capabilities: ClassVar[MemoryCapabilities] = MemoryCapabilities(cache=f"{_METHODS}:Norm")


class KvQuestion(Nothing):
    """What the question attends to, by head (SnapKV); everything was kept until it was asked."""

    capabilities: ClassVar[MemoryCapabilities] = MemoryCapabilities(
        privileged=True, cache=f"{_METHODS}:Question"
    )


class KvMerge(Nothing):
    """Tokens at even distances, each averaged with those whose keys are most like its own."""

    capabilities: ClassVar[MemoryCapabilities] = MemoryCapabilities(cache=f"{_METHODS}:Merge")


class KvEightBits(Nothing):
    """Everything in 8 bits, whatever the budget is."""

    capabilities: ClassVar[MemoryCapabilities] = MemoryCapabilities(cache=f"{_METHODS}:EightBits")
