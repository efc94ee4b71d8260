"""Any transformers model of a known family as a `Model`: conversations over one encoded prefix."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import torch

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.backend import BackendConversation
from model_adapters.hf.batch import answer_together
from model_adapters.hf.decoding import cut_at_stop, generate
from model_adapters.hf.embedding import Embedder
from model_adapters.hf.features import FeatureCache
from model_adapters.hf.loaded import Loaded
from model_adapters.hf.options import HfOptions
from model_adapters.hf.prefix import Prefix
from model_adapters.hf.prompt import Frame, Prompter, Piece, n_common, n_tokens, token_ids
from model_adapters.hf.rope import length_rope
from model_adapters.protocols import Part, Reply

__all__ = [
    "TransformersModel",
    "check_limit",
    "context_limit",
    "identity",
    "limit_before_extension",
    "naming_memory_errors",
]


class TransformersModel:
    """A loaded checkpoint behind the `Model` protocol.

    All conversations of a model share one encoded sequence: a reply keeps what its prompt has in common with the last
    one's, whichever conversation that was, so that conversations over the same frames share them too.

    Args:
        name: the registry's name.
        loaded: the checkpoint.
        options: how to run it.
    """

    def __init__(self, name: str, loaded: Loaded, options: HfOptions) -> None:
        self.name = name
        self._loaded = loaded
        self._options = options
        keep = options.feature_cache_mb * 2**20 if options.share_prefix else 0
        self._features = FeatureCache(loaded.family, keep)
        self._prompter = Prompter(loaded.tokenizer, loaded.template, loaded.family)
        self._embed = Embedder(loaded.model, loaded.family, self._features)
        self._rope = length_rope(loaded.model)
        self._prefix = Prefix(
            loaded.model,
            loaded.family,
            self._embed,
            chunk_tokens=options.chunk_tokens,
            rope=self._rope,
            storage=torch.device("cpu") if options.kv_offload else None,
        )

    @property
    def max_tokens(self) -> int | None:
        """The checkpoint's context limit, or the option's."""
        return context_limit(self._loaded, self._options)

    @property
    def max_tokens_before_extension(self) -> int | None:
        """The checkpoint's own limit where an option extends it."""
        return limit_before_extension(self._loaded, self._options)

    def identity(self) -> dict[str, Any]:
        """Checkpoint, precision, kernels, versions and generation settings, as JSON values."""
        return identity(self.name, self._loaded, self._options)

    def tokens_per_frame(self, frame: FrameRef) -> int:
        """How many tokens one frame becomes, as the checkpoint's processor has it."""
        return next(len(piece.ids) for piece in self.pieces([frame]) if isinstance(piece, Frame))

    def conversation(self) -> BackendConversation:
        """A new, empty conversation."""
        return BackendConversation(self, self._options.batch_size)

    def close(self) -> None:
        """Free the KV cache, the features and the weights."""
        self._prefix.reset()
        self._features.clear()
        del self._prefix, self._embed, self._features, self._rope, self._prompter, self._loaded
        if torch.cuda.is_available():
            torch.cuda.empty_cache()

    def pieces(self, parts: Sequence[Part]) -> list[Piece]:
        """What a reply to these parts would be made from."""
        return self._prompter.pieces(parts)

    def count(self, parts: Sequence[Part]) -> int:
        """Tokens that a reply to these parts would be made from."""
        return n_tokens(self.pieces(parts))

    def encode(self, pieces: Sequence[Piece]) -> torch.Tensor:
        """Encode a prompt from nothing, a few pieces at first; logits of the next token, (vocabulary,)."""
        self._prefix.reset()
        self._prefix.rewind_to(pieces)
        self._prefix.feed(pieces[:2])
        return self._prefix.feed(pieces[2:])

    def answer(self, parts: Sequence[Part], max_new_tokens: int, stop: Sequence[str]) -> Reply:
        """Answer one user turn; see `Conversation.reply`."""
        return self.answer_each([parts], max_new_tokens, stop)[0]

    def answer_each(self, prompts: Sequence[Sequence[Part]], max_new_tokens: int, stop: Sequence[str]) -> list[Reply]:
        """Answer several user turns, `batch_size` at a time; see `BatchingConversation.replies`."""
        requests = [self.pieces(parts) for parts in prompts]
        for pieces in requests:
            check_limit(self.name, n_tokens(pieces), max_new_tokens, self.max_tokens)
        # Rows of one batch have the same frequencies, and without sharing nothing is common to them.
        together = self._options.share_prefix and self._rope is None
        size = self._options.batch_size if together else 1
        batches = [requests[at : at + size] for at in range(0, len(requests), size)]
        return [reply for batch in batches for reply in self._answer_safely(batch, max_new_tokens, stop)]

    def _answer_safely(self, batch: Sequence[Sequence[Piece]], max_new_tokens: int, stop: Sequence[str]) -> list[Reply]:
        if not self._options.share_prefix:
            self._prefix.reset()
        try:
            with naming_memory_errors(self.name, sum(map(n_tokens, batch))):
                if len(batch) > 1:
                    return self._answer_batch(batch, max_new_tokens, stop)
                return [self._answer(batch[0], max_new_tokens, stop)]
        except ModelError:
            # Where memory ran out, the next request is to find all of it free.
            self._prefix.reset()
            self._features.clear()
            raise

    def _answer(self, pieces: Sequence[Piece], max_new_tokens: int, stop: Sequence[str]) -> Reply:
        shared = self._prefix.rewind_to(pieces)
        cached = self._prefix.n_tokens
        logits = self._prefix.feed(pieces[shared:], reserve=max_new_tokens)
        ids = generate(
            logits,
            lambda token: self._prefix.feed([token]),
            context=token_ids(pieces),
            settings=self._loaded.generation,
            max_new_tokens=max_new_tokens,
            finished=lambda ids: self._stopped(ids, stop),
        )
        return self._reply(ids, pieces, cached, stop)

    def _answer_batch(self, batch: Sequence[Sequence[Piece]], max_new_tokens: int, stop: Sequence[str]) -> list[Reply]:
        common = n_common(batch)
        shared = min(self._prefix.rewind_to(batch[0]), common)
        self._prefix.cut(shared)
        cached = self._prefix.n_tokens
        if shared < common:
            self._prefix.feed(batch[0][shared:common])
        found = answer_together(
            self._loaded.model,
            self._embed,
            prefix=self._prefix,
            prompts=batch,
            n_shared=common,
            settings=self._loaded.generation,
            max_new_tokens=max_new_tokens,
            finished=lambda ids: self._stopped(ids, stop),
        )
        reused = [cached, *[self._prefix.n_tokens] * (len(batch) - 1)]
        return [
            self._reply(ids, pieces, n_cached, stop) for ids, pieces, n_cached in zip(found, batch, reused, strict=True)
        ]

    def _reply(self, ids: list[int], pieces: Sequence[Piece], n_cached: int, stop: Sequence[str]) -> Reply:
        text = self._decode(ids)
        before_stop = cut_at_stop(text, stop)
        return Reply(text if before_stop is None else before_stop, tuple(ids), n_tokens(pieces), n_cached)

    def _stopped(self, ids: list[int], stop: Sequence[str]) -> bool:
        return bool(stop) and cut_at_stop(self._decode(ids), stop) is not None

    def _decode(self, ids: list[int]) -> str:
        return self._loaded.tokenizer.decode(ids, skip_special_tokens=True)


def context_limit(loaded: Loaded, options: HfOptions) -> int | None:
    """The checkpoint's context limit, or the option's; None for none."""
    return (loaded.max_tokens if options.max_tokens is None else options.max_tokens) or None


def limit_before_extension(loaded: Loaded, options: HfOptions) -> int | None:
    """The checkpoint's own limit where an option extends it; None where nothing is extended."""
    if options.rope is None:
        return None
    limit: int = loaded.model.config.get_text_config().max_position_embeddings
    return limit


def identity(name: str, loaded: Loaded, options: HfOptions) -> dict[str, Any]:
    """What distinguishes this model, run like this, from others, as JSON values."""
    generation = loaded.generation
    return loaded.identity | {
        "adapter": name,
        "max_tokens": context_limit(loaded, options),
        "share_prefix": options.share_prefix,
        "chunk_tokens": options.chunk_tokens,
        "batch_size": options.batch_size,
        "generation": {
            "do_sample": False,
            "repetition_penalty": generation.repetition_penalty,
            "end_ids": sorted(generation.end_ids),
        },
    }


def check_limit(name: str, n_context: int, max_new_tokens: int, limit: int | None) -> None:
    """Refuse what does not fit.

    Raises:
        ModelError: context and reply are beyond the limit.
    """
    if limit is not None and n_context + max_new_tokens > limit:
        raise ModelError(
            f"a context of {n_context} tokens and {max_new_tokens} new ones is beyond the {limit} tokens "
            f"of {name}; use fewer frames, or set max_tokens if the model can take more"
        )


@contextmanager
def naming_memory_errors(name: str, n_context: int) -> Iterator[None]:
    """Turn errors of memory into one line with the size of the context.

    Raises:
        ModelError: memory ran out.
    """
    try:
        yield
    except (RuntimeError, MemoryError) as error:
        # torch has an exception of its own for GPUs only; on CPU the allocator's name in the message tells.
        cpu = isinstance(error, MemoryError) or "DefaultCPUAllocator" in str(error)
        if not (cpu or isinstance(error, torch.OutOfMemoryError)):
            raise
        mend = "use fewer frames, kv_offload=true, or a smaller chunk_tokens"
        raise ModelError(f"out of memory on a context of {n_context} tokens ({name}); {mend}") from error
