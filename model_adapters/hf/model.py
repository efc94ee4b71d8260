"""Any transformers model of a known family as a `Model`: conversations over one encoded prefix."""

from collections.abc import Sequence
from typing import Any

import torch

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters.backend import BackendConversation
from model_adapters.hf.batch import answer_together
from model_adapters.hf.decoding import ReplyState, write
from model_adapters.hf.description import capabilities, identity
from model_adapters.hf.embedding import Embedder
from model_adapters.hf.features import FeatureCache
from model_adapters.hf.limits import check_limit, naming_memory_errors, naming_model_errors
from model_adapters.hf.loaded import Loaded
from model_adapters.hf.prefix import Prefix
from model_adapters.hf.prompt import Piece, Prompter, n_common, n_tokens, token_ids
from model_adapters.hf.replies import begin_reply, end_reply
from model_adapters.hf.rope import length_rope
from model_adapters.options.checkpoints import HfOptions
from model_adapters.protocols import Capabilities, Decoding, Reply, Turn

__all__ = ["TransformersModel"]


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
    def capabilities(self) -> Capabilities:
        """Sampling and choices, one request at a time, several continuations of a shared prefix together."""
        return capabilities(self._loaded, self._options, self._batch_size)

    def identity(self) -> dict[str, Any]:
        """Checkpoint, precision, kernels, versions and generation settings, as JSON values."""
        return identity(self.name, self._loaded, self._options)

    @property
    def loaded(self) -> Loaded:
        """The checkpoint, for whoever goes on with it."""
        return self._loaded

    def tokens_per_frame(self, frame: FrameRef) -> int:
        """How many tokens one frame becomes, as the checkpoint's processor has it."""
        with naming_model_errors(self.name):
            return len(self._prompter.frame(frame).ids)

    def conversation(self) -> BackendConversation:
        """A new, empty conversation."""
        return BackendConversation(self)

    def close(self) -> None:
        """Free the KV cache, the features and the weights."""
        self._prefix.reset()
        self._features.clear()
        del self._prefix, self._embed, self._features, self._rope, self._prompter, self._loaded
        if torch.cuda.is_available():
            torch.cuda.empty_cache()

    def pieces(self, turns: Sequence[Turn]) -> list[Piece]:
        """What a reply to these turns would be made from."""
        return self._prompter.pieces(turns)

    def count(self, turns: Sequence[Turn]) -> int:
        """Tokens that a reply to these turns would be made from."""
        with naming_model_errors(self.name):
            return n_tokens(self.pieces(turns))

    def encode(self, pieces: Sequence[Piece]) -> torch.Tensor:
        """Encode a prompt from nothing, a few pieces at first; logits of the next token, (vocabulary,)."""
        self._prefix.reset()
        self._prefix.rewind_to(pieces)
        self._prefix.feed(pieces[:2])
        return self._prefix.feed(pieces[2:])

    def answer(self, turns: Sequence[Turn], decoding: Decoding) -> Reply:
        """Answer a conversation; see `Conversation.reply`."""
        return self.answer_each([turns], decoding)[0]

    def answer_each(self, conversations: Sequence[Sequence[Turn]], decoding: Decoding) -> list[Reply]:
        """Answer several conversations, `batch_size` at a time; see `Conversation.replies`."""
        with naming_model_errors(self.name):
            prompts = [self.pieces(turns) for turns in conversations]
        for prompt in prompts:
            check_limit(self.name, n_tokens(prompt), decoding.max_new_tokens, self.capabilities.max_tokens)
        size = self._batch_size
        batches = [prompts[at : at + size] for at in range(0, len(prompts), size)]
        return [reply for batch in batches for reply in self._answer_safely(batch, decoding)]

    @property
    def _batch_size(self) -> int:
        # Rows of one batch have the same frequencies, and without sharing nothing is common to them.
        return self._options.batch_size if self._options.share_prefix and self._rope is None else 1

    def _answer_safely(self, prompts: Sequence[Sequence[Piece]], decoding: Decoding) -> list[Reply]:
        if not self._options.share_prefix:
            self._prefix.reset()
        replies = [begin_reply(self._loaded, decoding, token_ids(prompt)) for prompt in prompts]
        try:
            with naming_model_errors(self.name), naming_memory_errors(self.name, sum(map(n_tokens, prompts))):
                n_cached = self._write(prompts, replies)
        except ModelError:
            # Where memory ran out, the next request is to find all of it free.
            self._prefix.reset()
            self._features.clear()
            raise
        return [
            end_reply(self._loaded, reply, n_tokens(prompt), cached)
            for reply, prompt, cached in zip(replies, prompts, n_cached, strict=True)
        ]

    def _write(self, prompts: Sequence[Sequence[Piece]], replies: Sequence[ReplyState]) -> list[int]:
        """Write the replies; how many tokens of each prompt were there already."""
        return self._write_one(prompts[0], replies[0]) if len(prompts) == 1 else self._write_batch(prompts, replies)

    def _write_one(self, prompt: Sequence[Piece], reply: ReplyState) -> list[int]:
        shared = self._prefix.rewind_to(prompt)
        cached = self._prefix.n_tokens
        logits = self._prefix.feed(prompt[shared:], reserve=reply.decoding.max_new_tokens)
        write(logits[None], lambda tokens: self._prefix.feed(tokens)[None], [reply])
        return [cached]

    def _write_batch(self, prompts: Sequence[Sequence[Piece]], replies: Sequence[ReplyState]) -> list[int]:
        common = n_common(prompts)
        shared = min(self._prefix.rewind_to(prompts[0]), common)
        self._prefix.cut(shared)
        cached = self._prefix.n_tokens
        if shared < common:
            self._prefix.feed(prompts[0][shared:common])
        answer_together(
            self._loaded.model, self._embed, prefix=self._prefix, prompts=prompts, n_shared=common, replies=replies
        )
        return [cached, *[self._prefix.n_tokens] * (len(prompts) - 1)]
