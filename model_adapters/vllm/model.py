"""A model in vLLM as the harness talks to it."""

from collections.abc import Sequence
from typing import Any

from PIL import Image

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.backend import BackendConversation
from model_adapters.hf.choices import read_choices
from model_adapters.hf.limits import check_limit, naming_model_errors
from model_adapters.hf.loaded import Loaded
from model_adapters.hf.prompt import Frame, Piece, Prompter, n_common, n_tokens
from model_adapters.hf.replies import said, stop_ids
from model_adapters.protocols import Capabilities, Decoding, Reply, Turn
from model_adapters.vllm.engine import Engine, EngineOutput, EngineRequest, SamplingSettings
from model_adapters.vllm.options import VllmOptions

__all__ = ["VllmModel"]

_BATCH = 64  # continuations at once; vLLM itself decides how many of them it runs together
_SEEDS = 2**63  # of torch's generators
_OF_AN_OUTLINE = ("device", "dtype", "attn_implementation", "quantization")  # which runs nothing


class VllmModel:
    """A checkpoint in vLLM behind the `Model` protocol.

    What is read is written here, as for transformers: prompts go to vLLM as token ids, one placeholder per frame.
    What requests share, its prefix cache finds.

    Args:
        name: the registry's name.
        loaded: the checkpoint without weights.
        engine: has the weights.
        options: how it is run.
        max_tokens: most tokens of context and reply together.
        max_frames: most frames of a request.
    """

    def __init__(
        self, name: str, loaded: Loaded, engine: Engine, options: VllmOptions, *, max_tokens: int, max_frames: int
    ) -> None:
        self.name = name
        self._loaded = loaded
        self._engine = engine
        self._options = options
        self._max_tokens = max_tokens
        self._max_frames = max_frames
        self._prompter = Prompter(loaded.tokenizer, loaded.template, loaded.family)
        # vLLM ends a reply at the tokenizer's own end token too.
        self._ends = loaded.generation.end_ids | ({loaded.tokenizer.eos_token_id} - {None})
        self._images: dict[str, Image.Image] = {}  # of the last requests, by the digest of the frame's file
        self._read: Sequence[Piece] = ()  # by the last request

    @property
    def capabilities(self) -> Capabilities:
        """Sampling and choices, many continuations together; equal requests may differ by what is run beside them."""
        text = self._loaded.model.config.get_text_config()
        return Capabilities(
            deterministic=False,
            sampling=True,
            choices=True,
            batch_size=_BATCH,
            max_tokens=self._max_tokens,
            max_tokens_before_extension=None if self._options.rope is None else text.max_position_embeddings,
        )

    def identity(self) -> dict[str, Any]:
        """Checkpoint, precision, how vLLM runs it, versions and generation settings, as JSON values."""
        options, loaded = self._options, self._loaded
        described = {name: value for name, value in loaded.identity.items() if name not in _OF_AN_OUTLINE}
        return described | {
            "adapter": self.name,
            "engine": "vllm",
            "versions": {**loaded.identity["versions"], "vllm": self._engine.version},
            "dtype": options.dtype,
            "quantization": options.quantization or loaded.identity["quantization"],
            "max_tokens": self._max_tokens,
            "max_frames": self._max_frames,
            "prompt": options.prompt,
            "parallel": [options.tensor_parallel_size, options.pipeline_parallel_size, options.data_parallel_size],
            "enforce_eager": options.enforce_eager,
            "prefix_caching": options.prefix_caching,
            "batch_invariant": self._engine.batch_invariant,
            "seed": options.seed,
            "generation": {
                "repetition_penalty": loaded.generation.repetition_penalty,
                "end_ids": sorted(self._ends),
            },
        }

    def tokens_per_frame(self, frame: FrameRef) -> int:
        """How many tokens one frame becomes, as the checkpoint's processor has it."""
        with naming_model_errors(self.name):
            return len(self._prompter.frame(frame).ids)

    def conversation(self) -> BackendConversation:
        """A new, empty conversation."""
        return BackendConversation(self)

    def close(self) -> None:
        """End vLLM."""
        self._engine.close()
        self._images.clear()

    def count(self, turns: Sequence[Turn]) -> int:
        """Tokens that a reply to these turns would be made from."""
        with naming_model_errors(self.name):
            return n_tokens(self._prompter.pieces(turns))

    def answer(self, turns: Sequence[Turn], decoding: Decoding) -> Reply:
        """Answer a conversation; see `Conversation.reply`."""
        return self.answer_each([turns], decoding)[0]

    def answer_each(self, conversations: Sequence[Sequence[Turn]], decoding: Decoding) -> list[Reply]:
        """Answer several conversations; see `Conversation.replies`.

        Where they begin alike and vLLM has not read that yet, the first goes alone, so that the others, sent together,
        find what it left in the cache.
        """
        with naming_model_errors(self.name):
            prompts = [self._prompter.pieces(turns) for turns in conversations]
        for prompt in prompts:
            self._check(prompt, decoding)
        sampling = self._sampling(decoding)
        requests = self._requests(prompts)
        alone = 1 if self._shares_what_is_not_read(prompts) else 0
        written = self._engine.generate(requests[:alone], sampling) + self._engine.generate(requests[alone:], sampling)
        self._read = prompts[-1] if prompts else self._read
        return [self._reply(prompt, found, decoding) for prompt, found in zip(prompts, written, strict=True)]

    def _shares_what_is_not_read(self, prompts: Sequence[Sequence[Piece]]) -> bool:
        if len(prompts) < 2 or not self._options.prefix_caching:
            return False
        common = n_common(prompts)
        return list(self._read[:common]) != list(prompts[0][:common])

    def _check(self, prompt: Sequence[Piece], decoding: Decoding) -> None:
        check_limit(self.name, n_tokens(prompt), decoding.max_new_tokens, self._max_tokens, "max_model_len")
        n_frames = sum(isinstance(piece, Frame) for piece in prompt)
        if n_frames > self._max_frames:
            raise ModelError(f"{n_frames} frames are more than max_frames={self._max_frames} of {self.name}; raise it")

    def _sampling(self, decoding: Decoding) -> SamplingSettings:
        read_choices(self._loaded.tokenizer, decoding)  # refuses those that are longer than the reply may be
        settings: dict[str, Any] = {
            "max_tokens": decoding.max_new_tokens,
            "temperature": decoding.temperature,
            "repetition_penalty": self._loaded.generation.repetition_penalty,
            "stop_token_ids": sorted(self._ends),
        }
        if not decoding.greedy:
            settings |= {"top_p": decoding.top_p, "seed": decoding.seed % _SEEDS}
        if decoding.stop and not decoding.choices:
            # A special token is in no text that stop strings are looked for in, so it stops by its id.
            ends = self._ends | stop_ids(self._loaded.tokenizer, decoding)
            settings |= {"stop": list(decoding.stop), "stop_token_ids": sorted(ends)}
        return SamplingSettings(settings=settings, choices=decoding.choices)

    def _requests(self, prompts: Sequence[Sequence[Piece]]) -> list[EngineRequest]:
        frames = {piece.digest: piece.ref for prompt in prompts for piece in prompt if isinstance(piece, Frame)}
        self._images = {digest: self._images.get(digest) or ref.load() for digest, ref in frames.items()}
        return [self._request(prompt) for prompt in prompts]

    def _request(self, prompt: Sequence[Piece]) -> EngineRequest:
        placeholder = self._loaded.family.placeholder_id
        digests = [piece.digest for piece in prompt if isinstance(piece, Frame)]
        ids = [placeholder if isinstance(piece, Frame) else piece for piece in prompt]
        return EngineRequest(ids, [self._images[digest] for digest in digests], digests)

    def _reply(self, prompt: Sequence[Piece], written: EngineOutput, decoding: Decoding) -> Reply:
        expected = n_tokens(prompt)
        if written.n_context != expected:
            raise ModelError(
                f"{self.name}: vLLM {self._engine.version} reads {written.n_context} tokens where the checkpoint's "
                f"processor makes {expected}: it sees other frames; run it with --engine transformers"
            )
        ids = written.ids[:-1] if written.ids and written.ids[-1] in self._ends else written.ids
        return Reply(
            self._held(written.text, decoding) if decoding.choices else said(self._loaded.tokenizer, ids, decoding),
            n_reply_tokens=len(ids),
            n_context_tokens=written.n_context,
            n_cached_tokens=written.n_cached,
            token_ids=ids,
        )

    def _held(self, text: str, decoding: Decoding) -> str:
        if text not in decoding.choices:
            raise ModelError(
                f"{self.name}: vLLM {self._engine.version} answers {text[:40]!r}, which is none of the "
                f"{len(decoding.choices)} choices; raise max_new_tokens"
            )
        return text
