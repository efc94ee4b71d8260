"""A model in vLLM behind the `Model` protocol."""

from collections.abc import Sequence
from typing import Any

from PIL import Image

from infthor_eval.errors import ModelError
from model_adapters.hf.cached.decoding import read_choices
from model_adapters.hf.cached.replies import reply_text, stop_ids
from model_adapters.hf.checkpoint_model import CheckpointModel
from model_adapters.hf.limits import check_limit, wrap_model_errors
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.prompting.hashing import hash_context
from model_adapters.hf.prompting.prompt import Frame, Piece, n_common, n_tokens
from model_adapters.protocols import Capabilities, Decoding, Reply, Turn
from model_adapters.vllm.engine import Engine, EngineOutput, EngineRequest
from model_adapters.vllm.options import VllmOptions

_BATCH = 64  # continuations per call; vLLM decides how many of them it runs together
_SEEDS = 2**63  # number of seeds of torch's generators
# Of the meta model, which does not run.
_META_KEYS = ("device", "dtype", "attn_implementation", "quantization")


class VllmModel(CheckpointModel):
    """A checkpoint in vLLM behind the `Model` protocol.

    Prompts are written here, as for transformers, and go to vLLM as token ids with one placeholder
    per frame. vLLM's prefix cache finds what requests share. `loaded` is the checkpoint without
    weights, which the engine has.
    """

    def __init__(
        self,
        name: str,
        loaded: LoadedCheckpoint,
        engine: Engine,
        options: VllmOptions,
        *,
        max_tokens: int,
        max_frames: int,
    ) -> None:
        super().__init__(name, loaded)
        self._engine = engine
        self._options = options
        self._max_tokens = max_tokens
        self._max_frames = max_frames
        # vLLM also ends a reply at the tokenizer's end token.
        self._ends = loaded.generation.end_ids | ({loaded.tokenizer.eos_token_id} - {None})
        # Frames of the last requests, by the digest of the file.
        self._images: dict[str, Image.Image] = {}
        self._last_prompt: Sequence[Piece] = ()

    @property
    def capabilities(self) -> Capabilities:
        """Sampling and choices, many continuations together; replies may depend on what runs in the
        same batch."""
        text = self._loaded.model.config.get_text_config()
        return Capabilities(
            deterministic=False,
            sampling=True,
            choices=True,
            image_input=self._prompter.takes_frames,
            batch_size=_BATCH,
            batch_contexts=True,
            max_tokens=self._max_tokens,
            max_tokens_before_extension=None
            if self._options.rope is None
            else text.max_position_embeddings,
        )

    def identity(self) -> dict[str, Any]:
        """Return checkpoint, precision, engine settings, versions, generation settings, as JSON."""
        options = self._options
        loaded = self._loaded
        checkpoint = {
            name: value for name, value in loaded.identity.items() if name not in _META_KEYS
        }
        return checkpoint | {
            "adapter": self.name,
            "engine": "vllm",
            "versions": {**loaded.identity["versions"], "vllm": self._engine.version},
            "dtype": options.dtype,
            "quantization": options.quantization or loaded.identity["quantization"],
            "max_tokens": self._max_tokens,
            "max_frames": self._max_frames,
            "image_backend": options.image_backend,
            "prompt": options.prompt,
            "parallel": [
                options.tensor_parallel_size,
                options.pipeline_parallel_size,
                options.data_parallel_size,
            ],
            "enforce_eager": options.enforce_eager,
            "prefix_caching": options.prefix_caching,
            "throughput": options.throughput() | options.encoder_cache(),
            "batch_invariant": self._engine.batch_invariant,
            "seed": options.seed,
            "generation": {
                "repetition_penalty": loaded.generation.repetition_penalty,
                "end_ids": sorted(self._ends),
            },
        }

    def close(self) -> None:
        """Stop vLLM."""
        self._engine.close()
        self._images.clear()

    def answer_each(
        self, conversations: Sequence[Sequence[Turn]], decoding: Decoding
    ) -> list[Reply]:
        """Answer several conversations; see `Conversation.replies`.

        Those with a long prefix that is not in vLLM's cache are sent first, one for each prefix,
        and fill it: sent together with the others, all of them would compute the prefix.
        """
        with wrap_model_errors(self.name):
            prompts = [self.pieces(turns) for turns in conversations]
        for prompt in prompts:
            self._check_size(prompt, decoding)
        settings = self._settings(decoding)
        requests = self._requests(prompts)
        first = self._new_prefixes(prompts)
        outputs: dict[int, EngineOutput] = {}
        for wave in (first, [at for at in range(len(prompts)) if at not in first]):
            sent = self._engine.generate([requests[at] for at in wave], settings, decoding.choices)
            outputs |= zip(wave, sent, strict=True)
        self._last_prompt = prompts[-1] if prompts else self._last_prompt
        return [self._reply(prompt, outputs[at], decoding) for at, prompt in enumerate(prompts)]

    def _new_prefixes(self, prompts: Sequence[Sequence[Piece]]) -> list[int]:
        """Return the prompts that share less than half of their tokens with the one before them."""
        if not self._options.prefix_caching:
            return list(range(len(prompts)))
        before = [self._last_prompt, *prompts]
        return [
            at
            for at, (last, prompt) in enumerate(zip(before, prompts, strict=False))
            if not last or 2 * n_tokens(prompt[: n_common([last, prompt])]) < n_tokens(prompt)
        ]

    def _check_size(self, prompt: Sequence[Piece], decoding: Decoding) -> None:
        check_limit(
            self.name, n_tokens(prompt), decoding.max_new_tokens, self._max_tokens, "max_model_len"
        )
        n_frames = sum(isinstance(piece, Frame) for piece in prompt)
        if n_frames > self._max_frames:
            raise ModelError(
                f"{n_frames} frames are more than max_frames={self._max_frames} of {self.name}; "
                "raise it"
            )

    def _settings(self, decoding: Decoding) -> dict[str, Any]:
        # Refuses choices that are longer than the reply may be.
        read_choices(self._loaded.tokenizer, decoding)
        own = self._loaded.generation.repetition_penalty
        penalty = decoding.repetition_penalty
        settings: dict[str, Any] = {
            "max_tokens": decoding.max_new_tokens,
            "temperature": decoding.temperature,
            "repetition_penalty": own if penalty is None else penalty,
            "stop_token_ids": sorted(self._ends),
        }
        if self._options.margins:
            settings["logprobs"] = 2  # the likeliest two
        if not decoding.greedy:
            settings |= {"top_p": decoding.top_p, "seed": decoding.seed % _SEEDS}
        if decoding.stop and not decoding.choices:
            # vLLM searches the text for stop strings, in which special tokens do not appear: these
            # stop by their id.
            ends = self._ends | stop_ids(self._loaded.tokenizer, decoding)
            settings |= {"stop": list(decoding.stop), "stop_token_ids": sorted(ends)}
        return settings

    def _requests(self, prompts: Sequence[Sequence[Piece]]) -> list[EngineRequest]:
        frames = {
            piece.digest: piece.ref
            for prompt in prompts
            for piece in prompt
            if isinstance(piece, Frame)
        }
        self._images = {
            digest: self._images.get(digest) or ref.load() for digest, ref in frames.items()
        }
        return [self._request(prompt) for prompt in prompts]

    def _request(self, prompt: Sequence[Piece]) -> EngineRequest:
        placeholder = self._loaded.family.placeholder_id
        digests = [piece.digest for piece in prompt if isinstance(piece, Frame)]
        ids = [piece if isinstance(piece, int) else placeholder for piece in prompt]
        return EngineRequest(ids, [self._images[digest] for digest in digests], digests)

    def _reply(self, prompt: Sequence[Piece], output: EngineOutput, decoding: Decoding) -> Reply:
        expected, n_context = n_tokens(prompt), len(output.context)
        if n_context != expected:
            raise ModelError(
                f"{self.name}: vLLM {self._engine.version} reads {n_context} tokens where "
                f"the checkpoint's processor makes {expected}: it processes frames differently; "
                "run it with --engine transformers"
            )
        ids = output.ids[:-1] if output.ids and output.ids[-1] in self._ends else output.ids
        free_text = reply_text(self._loaded, ids, decoding)
        return Reply(
            self._require_choice(output.text, decoding) if decoding.choices else free_text,
            n_reply_tokens=len(ids),
            n_context_tokens=n_context,
            n_cached_tokens=output.n_cached,
            token_ids=ids,
            context_hash=hash_context(output.context),
            margins=output.margins,
        )

    def _require_choice(self, text: str, decoding: Decoding) -> str:
        if text not in decoding.choices:
            raise ModelError(
                f"{self.name}: vLLM {self._engine.version} answers {text[:40]!r}, which is none of "
                f"the {len(decoding.choices)} choices; raise max_new_tokens"
            )
        return text
