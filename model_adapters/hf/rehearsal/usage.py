"""Memory of a context and work of a frame, by running the model's code on shapes.

A context is lengthened to its size without computing (`Prefix.lengthen`), then frames, a question,
a token of a reply, and several questions together are encoded behind it, as in a run. What is
allocated at a time is the memory of the context.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any

import torch
from torch.utils.flop_counter import FlopCounterMode
from transformers.modeling_utils import ALL_ATTENTION_FUNCTIONS

from infthor_eval.errors import ModelError, wrap_errors
from infthor_eval.formats.frames import FrameRef
from model_adapters.hf.cached.batch import encode_together
from model_adapters.hf.cached.branch_attention import layer_windows
from model_adapters.hf.cached.prefix import Prefix, chunks
from model_adapters.hf.prompting.ahead import Ahead
from model_adapters.hf.prompting.prompt import Frame, Piece, n_tokens
from model_adapters.hf.rehearsal.device import ShapesDevice
from model_adapters.hf.rehearsal.kernels import Attention
from model_adapters.hf.rehearsal.model import RehearsedModel

_QUESTION = 60  # tokens of a question and what is around it, as in benchmarks/cost.md
_TOGETHER = 25  # most questions on a trajectory of the published set
_MIB = 2**20
_FIRST_STEPS = (32, 512)
_MOST_TRIALS = 6
_TOKEN = 0  # any token of text

Kernels = Counter[
    tuple[str, bool, int]
]  # calls by kernel, by whether they have a mask, by head size
_FLASH_ATTENTION = "flash_attention_2"
_LARGEST_HEAD = 256
_SUM_BYTES = 4  # of a row's sum, which is kept in float32


@dataclass(frozen=True)
class Usage:
    """Memory of one context, in bytes.

    Attributes:
        n_tokens: tokens of the context.
        weights: weights and buffers.
        cache: keys and values, and states of linear layers.
        activations: most that is allocated beside these while a chunk of frames, a question or a
            token is encoded.
        together: the same while questions are answered together; 0 if the model cannot.
        features: features of earlier frames that are kept.
        kernels: calls of attention to the context, by what is encoded.
    """

    n_tokens: int
    weights: int
    cache: int
    activations: int
    together: int
    features: int
    kernels: dict[str, Kernels]

    @property
    def total(self) -> int:
        """All of it."""
        return self.weights + self.cache + max(self.activations, self.together) + self.features


@dataclass(frozen=True)
class FrameWork:
    """Work of encoding frames.

    Attributes:
        n_tokens: tokens of a frame, with those around it.
        flop: of the products of matrices for one frame, the vision tower's among them.
        attention: of attention for one frame, to a context of the given length.
    """

    n_tokens: int
    flop: float
    attention: float


class Rehearsal:
    """Runs of one model.

    Args:
        rehearsed: the model.
        frames: pictures of the set's size, at least one.
        flash: whether its decoder attends by flash-attn instead of the kernel of its options.
    """

    def __init__(
        self, rehearsed: RehearsedModel, frames: Sequence[FrameRef], *, flash: bool = False
    ) -> None:
        self._rehearsed = rehearsed
        self._flash = flash
        self._device = rehearsed.device
        self._weights = rehearsed.weights
        self._frames = frames
        self._usages: dict[int, Usage] = {}
        options = rehearsed.options
        self._chunk_tokens = options.chunk_size("cuda")
        cache_bytes = options.feature_cache_mb * _MIB if options.share_prefix else 0
        self._features = 0 if rehearsed.problem else cache_bytes
        self._embed = rehearsed.family.make_embed(cache_bytes, Ahead(n_threads=0))
        self._prefix = Prefix(
            rehearsed.model, rehearsed.family, self._embed, chunk_tokens=self._chunk_tokens
        )
        self._chunk = self._frames_of_a_chunk()
        with self._running():
            self._vision = self._vision_bytes()
            words = self._embed.words([_TOKEN, _TOKEN], [0, 0])
            self._branches = (
                options.share_prefix
                and options.batch_size > 1
                and layer_windows(rehearsed.model, words) is not None
            )
            self._device.attention.clear()
            self._start(2, 0)
            self._probe = [*self._device.attention]

    @property
    def frame_tokens(self) -> int:
        """Tokens of a frame, with those around it in a prompt; 0 if frames cannot be counted."""
        return 0 if self._rehearsed.problem else n_tokens(self._frame(0))

    @property
    def flash_problem(self) -> str:
        """Why the decoder cannot attend by flash-attn; empty if it can."""
        if not getattr(self._rehearsed.model, "_supports_flash_attn", False):
            return "the model's code does not support it"
        largest = max(call.head_size for call in self._probe)
        if largest > _LARGEST_HEAD:
            return f"heads of {largest} are larger than {_LARGEST_HEAD}"
        sees_ahead = self._embed.sees_ahead
        return "it cannot attend in both directions over a frame" if sees_ahead else ""

    def usage(self, n_context: int) -> Usage:
        """Return the memory of a context of so many tokens."""
        if n_context not in self._usages:
            self._usages[n_context] = self._measure(n_context)
        return self._usages[n_context]

    def largest(self, budget: float, step: int) -> int:
        """Return the largest context, a multiple of `step` tokens, that takes at most `budget`
        bytes; 0 if there is none.

        Memory grows along a line for long contexts, so it is found where the line through the last
        two measured contexts meets the budget.
        """
        before, last = (n * step for n in _FIRST_STEPS)
        best = 0
        for _ in range(_MOST_TRIALS):
            slope = (self.usage(last).total - self.usage(before).total) / (last - before)
            n_more = (budget - self.usage(last).total) / slope
            reached = (last + int(n_more)) // step * step
            if reached < step:
                return best
            left = budget - self.usage(reached).total
            if left >= 0:
                best = max(best, reached)
            if reached == last or 0 <= left < slope * step:
                return best
            before, last = last, reached
        return best

    def frame_work(self, n_context: int) -> FrameWork:
        """Return the work of frames behind a context of so many tokens."""
        n_frames = sum(isinstance(piece, Frame) for piece in self._chunk)
        with self._running():
            self._start(n_context, n_tokens(self._chunk))
            self._embed.clear()
            self._device.attention.clear()
        # Below the device, which hands operations on to it.
        with FlopCounterMode(display=False) as counter, self._running():
            self._prefix.feed(self._chunk)
        flop = counter.get_total_flops()
        attention = sum(call.flop for call in self._device.attention)
        return FrameWork(self.frame_tokens, flop / n_frames, attention / n_frames)

    def _vision_bytes(self) -> int:
        """Return the most memory that the vision tower takes for the frames of a chunk."""
        held = self._device.allocated
        self._device.reset_peak()
        if not self._rehearsed.problem:
            self._embed(self._chunk, 0, ())
        return self._device.peak - held

    @contextmanager
    def _running(self) -> Iterator[None]:
        model = self._rehearsed.model
        decoder = model.get_decoder().config
        problem = f"{model.config.model_type} cannot be rehearsed"
        with (
            torch.inference_mode(),
            _flash_attention(decoder, self._device) if self._flash else nullcontext(),
            # Any error is possible: code that needs numbers finds none.
            wrap_errors(problem, "measure on a GPU", catch=Exception, raise_as=ModelError),
            self._device.running(),
        ):
            yield

    def _frame(self, number: int) -> list[Piece]:
        """Return a frame as pieces of a prompt; each number is a frame of its own."""
        family = self._rehearsed.family
        ref = self._frames[number % len(self._frames)]
        frame = Frame(str(number), ref.size, family.frame_ids(ref.size), ref)
        placeholder = family.placeholder_id
        written = family.template_ids(placeholder)
        return [frame if token == placeholder else token for token in written]

    def _frames_of_a_chunk(self) -> list[Piece]:
        """Return pieces of one chunk: frames, or text where frames cannot be counted."""
        size = self._chunk_tokens
        if self._rehearsed.problem:
            return [_TOKEN] * size
        pieces: list[Piece] = []
        for number in range(max(1, size // self.frame_tokens)):
            pieces += self._frame(number)
        return next(chunks(pieces, max(size, self.frame_tokens)))

    def _start(self, n_context: int, n_left: int) -> None:
        """Encode a context up to what is left to feed."""
        self._prefix.reset()
        self._prefix.feed([_TOKEN], reserve=n_context - 1)
        self._prefix.lengthen(max(1, n_context - 1 - n_left))

    def _measure(self, n_context: int) -> Usage:
        device = self._device
        # A context may be shorter than a chunk.
        size = max(self.frame_tokens, n_context - _QUESTION - 2)
        chunk = next(chunks(self._chunk, size))
        with self._running():
            self._prefix.reset()
            held = device.allocated  # weights, and features of the frames below
            self._start(n_context, n_tokens(chunk) + _QUESTION + 1)
            device.reset_peak()
            kernels = {
                name: self._attention(partial(self._prefix.feed, pieces))
                for name, pieces in {**self.parts, "frames": chunk}.items()
            }
            cache = device.allocated - held
            activations = max(device.peak - held - cache, self._vision)
            together = 0
            if self._branches:
                device.reset_peak()
                kernels["questions together"] = self._attention(self._answer_together)
                together = device.peak - held - cache
        return Usage(
            n_context, self._weights, cache, activations, together, self._features, kernels
        )

    @property
    def parts(self) -> dict[str, Sequence[Piece]]:
        """What is encoded behind a context, in order."""
        return {
            "frames": self._chunk,
            "a question": [_TOKEN] * _QUESTION,
            "a token of a reply": [_TOKEN],
        }

    def _attention(self, run: Callable[[], Any]) -> Kernels:
        """Return the calls of attention to more than half of the context."""
        self._device.attention.clear()
        run()
        half = self._prefix.n_tokens // 2
        calls = [call for call in self._device.attention if call.n_keys > half]
        return Counter((call.kernel, call.has_mask, call.head_size) for call in calls)

    def _answer_together(self) -> None:
        """Encode questions together, as many as a trajectory of the published set has at most."""
        n_questions = min(self._rehearsed.options.batch_size, _TOGETHER)
        encode_together(self._prefix, [[_TOKEN] * _QUESTION] * n_questions)


@contextmanager
def _flash_attention(config: Any, device: ShapesDevice) -> Iterator[None]:
    """Let a decoder with this config attend by flash-attn within the context.

    It may be installed or not. It takes no mask and knows by itself who attends to whom, by windows
    of layers too; heads that share keys are not repeated. So it needs less memory than torch's
    attention with a mask.
    """

    def attend(
        module: Any,  # noqa: ARG001 - the form of transformers' attention functions
        query: torch.Tensor,
        key: torch.Tensor,
        value: torch.Tensor,
        *_: Any,
        **__: Any,
    ) -> tuple[torch.Tensor, None]:
        batch, heads, n_queries, head = query.shape
        call = Attention(
            kernel=_FLASH_ATTENTION,
            has_mask=False,
            n_queries=n_queries,
            n_keys=key.shape[-2],
            head_size=head,
            flop=2 * batch * heads * n_queries * key.shape[-2] * (head + value.shape[-1]),
            own_bytes=batch * heads * n_queries * _SUM_BYTES,
        )
        device.attention.append(call)
        device.use(call.own_bytes)
        return query.new_empty((batch, n_queries, heads, value.shape[-1])), None

    before = config._attn_implementation
    ALL_ATTENTION_FUNCTIONS[_FLASH_ATTENTION] = attend
    config._attn_implementation = _FLASH_ATTENTION
    try:
        yield
    finally:
        config._attn_implementation = before
        del ALL_ATTENTION_FUNCTIONS[_FLASH_ATTENTION]
