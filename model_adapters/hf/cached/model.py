"""Any transformers model of a known family as a `Model`; conversations share an encoded prefix."""

from collections.abc import Sequence
from functools import cached_property

import torch

from infthor_eval.errors import ModelError
from model_adapters.hf.cached.batch import answer_together, encode_together
from model_adapters.hf.cached.branch_attention import layer_windows
from model_adapters.hf.cached.decoding import ReplyState, decode_replies
from model_adapters.hf.cached.prefix import Prefix, PrefixStore
from model_adapters.hf.cached.replies import begin_reply, end_reply
from model_adapters.hf.checkpoint_model import HfModel
from model_adapters.hf.global_settings import torch_threads
from model_adapters.hf.kept.cutting import (
    CutPrefix,
    attention_of,
    grouped,
    method_of,
)
from model_adapters.hf.kept.view import CacheView
from model_adapters.hf.limits import check_limit, wrap_memory_errors, wrap_model_errors
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.loading.rope import take_length_rope
from model_adapters.hf.prompting.ahead import Ahead
from model_adapters.hf.prompting.prompt import Piece, n_common, n_nested, n_tokens, token_ids
from model_adapters.hf.sparse.chosen import ChosenAttention
from model_adapters.hf.sparse.reading import SparseReading
from model_adapters.hf.sparse.rotation import find_rotations
from model_adapters.hf.sparse.window import WindowAttention
from model_adapters.options.attention import POSITIONS, AttentionShape, Window, parse_attention
from model_adapters.options.checkpoints import HfOptions
from model_adapters.protocols import CacheCut, Decoding, KeptCache, Reply, Turn


class TransformersModel(HfModel):
    """A loaded checkpoint behind the `Model` protocol.

    All conversations of a model share one encoded sequence. A reply reuses what its prompt has in
    common with the previous prompt, whichever conversation that was of, so conversations over the
    same frames encode them once.
    """

    cuts_caches = True

    def __init__(self, name: str, loaded: LoadedCheckpoint, options: HfOptions) -> None:
        super().__init__(name, loaded, options)
        cache_bytes = options.feature_cache_mb * 2**20 if options.share_prefix else 0
        self._embed = loaded.family.make_embed(
            cache_bytes, Ahead(options.frame_threads, options.frames_ahead_mb * 2**20)
        )
        self._rope = take_length_rope(loaded.model)
        self._prefix = self._new_prefix()
        # What memories of the cache are cut from.
        self._encoded = PrefixStore(self._new_prefix, options.encoded_mb * 2**20)
        if options.attention is not None:
            self._prefix.sparse = self._read_sparsely(parse_attention(options.attention))

    def _new_prefix(self) -> Prefix:
        return Prefix(
            self._loaded.model,
            self._loaded.family,
            self._embed,
            chunk_tokens=self._chunk_tokens,
            rope=self._rope,
            storage=torch.device("cpu") if self._options.kv_offload else None,
        )

    def _read_sparsely(self, shape: AttentionShape) -> SparseReading:
        """Return how sequences are read by the options.

        Raises:
            ModelError: the model attends, or has positions, in a way that does not allow it.
        """
        options = self._options
        if self.windows is None:
            raise ModelError(
                f"{self.name}: attention={options.attention} needs a model all of whose layers "
                "attend by transformers' interface, without caps or states, with one set of rotary "
                "frequencies; leave it out"
            )
        rule: WindowAttention | ChosenAttention
        if isinstance(shape, Window):
            positions = options.positions or (POSITIONS[0] if shape.sinks else "absolute")
            is_turned = positions != "absolute"
            rotations = find_rotations(self._loaded.model, self._embed) if is_turned else ()
            rule = WindowAttention(shape, positions, rotations)
        else:
            rule = ChosenAttention(shape)
        weight = self._loaded.model.get_input_embeddings().weight
        config = self._loaded.model.get_decoder().config
        by_frames = options.attention_unit == "frames"
        return SparseReading(config, rule, weight.device, by_frames=by_frames)

    def fix_rope(self, n_positions: int) -> None:
        """Give all sequences of a training the rotary frequencies of one length, where they depend
        on the length."""
        if self._rope is not None:
            self._rope.set(n_positions)

    def close(self) -> None:
        """Free the KV cache, the features and the weights."""
        self._prefix.reset()
        self._encoded.clear()
        self._embed.close()
        del self._prefix, self._embed, self._rope
        super().close()

    def forget(self) -> None:
        """Drop what is encoded."""
        self._prefix.reset()
        self._encoded.clear()

    def encode(self, pieces: Sequence[Piece]) -> torch.Tensor:
        """Encode a prompt anew, in two parts; return the next token's logits, (vocabulary,)."""
        self._prefix.reset()
        self._prefix.rewind_to(pieces)
        self._prefix.feed(pieces[:2])
        return self._prefix.feed(pieces[2:])

    def encode_together(self, prompts: Sequence[Sequence[Piece]]) -> torch.Tensor:
        """Encode prompts anew as continuations of what they share; return each next token's logits,
        (prompts, vocabulary).

        The last piece of each is fed by itself, as tokens of replies are.
        """
        common = n_common([prompt[:-1] for prompt in prompts])
        self._prefix.reset()
        self._prefix.feed(prompts[0][:common])
        return encode_together(self._prefix, [prompt[common:] for prompt in prompts])

    def answer_each(
        self, conversations: Sequence[Sequence[Turn]], decoding: Decoding
    ) -> list[Reply]:
        """Answer several conversations, `batch_size` at a time; see `Conversation.replies`."""
        with wrap_model_errors(self.name):
            prompts = [self.pieces(turns) for turns in conversations]
        for prompt in prompts:
            check_limit(
                self.name, n_tokens(prompt), decoding.max_new_tokens, self.capabilities.max_tokens
            )
        size = self._batch_size
        batches = [prompts[at : at + size] for at in range(0, len(prompts), size)]
        with torch_threads(self._threads):
            return [reply for batch in batches for reply in self._answer_batch(batch, decoding)]

    @property
    def _batch_size(self) -> int:
        size = self._options.batch_size
        return size if size > 1 and self.windows is not None else 1

    @cached_property
    def windows(self) -> frozenset[int] | None:
        """Windows and chunks of the model's layers, in tokens; None if continuations cannot be
        answered together."""
        # Branches have to share one prefix and one set of rotary frequencies.
        if not self._options.share_prefix or self._rope is not None:
            return None
        with wrap_model_errors(self.name), torch_threads(self._threads):
            return layer_windows(self._loaded.model, self._embed.words([0, 0], [0, 0]))

    def _answer_batch(self, prompts: Sequence[Sequence[Piece]], decoding: Decoding) -> list[Reply]:
        if not self._options.share_prefix:
            self._prefix.reset()
        margins = self._options.margins
        replies = [
            begin_reply(self._loaded, decoding, token_ids(prompt), keep_margins=margins)
            for prompt in prompts
        ]
        n_shared = self._n_shared(prompts)
        kept: list[KeptCache | None] = [None] * len(prompts)
        try:
            with (
                wrap_model_errors(self.name),
                wrap_memory_errors(self.name, sum(map(n_tokens, prompts))),
            ):
                if decoding.cache is not None:
                    n_cached, kept = self._decode_behind_cuts(prompts, decoding.cache, replies)
                elif n_shared:
                    n_cached = self._decode_branches(prompts, n_shared, replies)
                else:
                    n_cached = self._decode_each(prompts, replies)
        except ModelError:
            # After running out of memory, the next request needs all of it.
            self.forget()
            self._embed.clear()
            raise
        return [
            end_reply(
                self._loaded, reply, [*token_ids(prompt)], self._embed.hash(prompt), cached, part
            )
            for reply, prompt, cached, part in zip(replies, prompts, n_cached, kept, strict=True)
        ]

    def _n_shared(self, prompts: Sequence[Sequence[Piece]]) -> list[int]:
        """Return how many pieces of each prompt are encoded once, where replies to them can be
        decoded together; nothing where not."""
        if len(prompts) == 1:
            return []
        shared = n_nested(prompts)
        sparse = self._prefix.sparse
        if sparse is not None:
            # Beginnings of what is read are dropped, or were read by what comes later; so is a text
            # by the chunk that it shares with what is asked.
            is_text = all(isinstance(piece, int) for piece in prompts[0])
            is_alike = len(set(shared)) == 1 and not (sparse.goes_by_chunks and is_text)
            return shared if is_alike else []
        if not shared and not self._embed.sees_ahead:
            shared = [n_common(prompts)] * len(prompts)
        return shared

    def _decode_each(
        self, prompts: Sequence[Sequence[Piece]], replies: Sequence[ReplyState]
    ) -> list[int]:
        """Decode replies one after the other; return how many tokens of each prompt were in the
        cache."""
        n_cached = []
        for prompt, reply in zip(prompts, replies, strict=True):
            shared = self._prefix.rewind_to(prompt)
            n_cached.append(self._prefix.n_tokens)
            logits = self._prefix.feed(prompt[shared:], reserve=reply.decoding.max_new_tokens)
            decode_replies(
                logits[None], lambda tokens: self._prefix.step(list(tokens.values()))[None], [reply]
            )
        return n_cached

    def _decode_behind_cuts(
        self, prompts: Sequence[Sequence[Piece]], cut: CacheCut, replies: Sequence[ReplyState]
    ) -> tuple[list[int], list[KeptCache | None]]:
        """Decode replies behind what is kept of the frames before the last one; return how many
        tokens of each prompt were encoded already, and what was kept."""
        if self.windows is None or self.windows:
            raise ModelError(
                f"the cache of {self.name} cannot be cut: not all layers see everything, or their "
                "rotary frequencies depend on the length; use a memory of frames"
            )
        asks = method_of(cut).asks
        n_cached: list[int] = []
        kept: list[KeptCache | None] = []
        for group in grouped(prompts, together=not asks):
            prefix, n_known = self._encoded.encode(group.before, exactly=asks)
            view = CacheView.of(prefix, group.before, group.n_opening, cut)
            if asks:
                view.attention = attention_of(prefix, group.afters[0])
            n_before = len(group.before)
            cut_prefix = CutPrefix(prefix, view, cut, prefix.behind(n_before))
            own = [replies[number] for number in group.numbers]
            answer_together(cut_prefix, group.afters, [0] * len(own), own)
            known = [n_known, *[n_before] * (len(group.afters) - 1)]
            n_cached += map(prefix.tokens_in, known)
            kept += [cut_prefix.kept] * len(group.afters)
        return n_cached, kept

    def _decode_branches(
        self,
        prompts: Sequence[Sequence[Piece]],
        n_shared: Sequence[int],
        replies: Sequence[ReplyState],
    ) -> list[int]:
        """Decode replies together; return how many tokens of each prompt were in the cache."""
        most = max(n_shared)
        longest = prompts[n_shared.index(most)]
        # The cached sequence may share more with that prompt than others do.
        cached = self._prefix.rewind_to([*longest[:most], 0])
        n_cached = self._prefix.n_tokens
        if cached < most:
            self._prefix.feed(longest[cached:most])
        answer_together(self._prefix, prompts, n_shared, replies)
        in_cache = [self._prefix.tokens_in(n) for n in n_shared]
        return [min(n_cached, in_cache[0]), *in_cache[1:]]
