"""Attention of several continuations of one prefix that stand behind it in one sequence.

Every token attends to the prefix, or to the beginning of it that its continuation continues, and to
the earlier tokens of its own continuation, as far as the model lets it: which of them a layer sees
(all, a window, a chunk) is asked of the model's own mask functions, with the positions that the
tokens have in prefix and continuation. So keys and values of the prefix are stored once and read
once for all continuations, as in Hydragen (arXiv:2402.05099).
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import torch
from torch import Tensor

from model_adapters.hf.cached.kv_cache import BufferedCache, cache_arguments
from model_adapters.hf.prompting.embedding import Span
from model_adapters.hf.sparse.interface import (
    CannotAttendError,
    MaskFunction,
    attending,
    require_plain,
    seen_by,
)
from model_adapters.hf.sparse.kernel import Keys, attend
from model_adapters.hf.sparse.layout import Layout
from model_adapters.hf.sparse.reading import SparseReading

_HINT = "set batch_size=1"


class _WatchedCache(BufferedCache):
    """A cache that notes whether a model asks how long it is, other than for its masks.

    Such a model (Llama 4 with its temperature by position) counts a token's position by what is
    stored before it, which is wrong behind other branches.
    """

    def __init__(self, config: Any) -> None:
        super().__init__(config)
        self.was_measured = False

    def get_seq_length(self, layer_idx: int = 0) -> int:
        """Return the number of stored tokens."""
        self.was_measured = True
        return super().get_seq_length(layer_idx)

    def get_query_offset(self, layer_idx: int = 0) -> int:
        """Return the number of stored tokens, for masks."""
        return super().get_seq_length(layer_idx)


@torch.inference_mode()
def layer_windows(model: Any, words: Span) -> frozenset[int] | None:
    """Return the windows and chunks, in tokens, that bound what layers attend to.

    The model is run on two words as two branches, so that its own code says which masks it makes
    and whether `BranchAttention` can take the place of its attention; None if it cannot.
    """
    decoder = model.get_decoder()
    # Eager attention is chosen for what its model adds to the scores.
    if (
        not getattr(decoder, "_supports_attention_backend", False)
        or decoder.config._attn_implementation == "eager"
    ):
        return None
    cache = _WatchedCache(decoder.config)
    if cache.needs_marks:  # some layers keep one state for all branches
        return None
    attention = BranchAttention(decoder.config, 0, words.positions.device)
    try:
        with attention.appended([0, 1], [0, 0], words.positions):
            model(
                **words.inputs,
                position_ids=words.positions,
                **cache_arguments(model, cache),
                logits_to_keep=1,
            )
    except CannotAttendError:
        return None
    return None if cache.was_measured else frozenset(attention.windows)


class BranchAttention:
    """Attention in a sequence of a prefix and branches, its continuations, in pieces of any order.

    Args:
        config: config of the decoder.
        n_prefix: tokens of the prefix.
        seen: how many of them each branch continues; all where it is empty.
        device: device of the decoder's inputs.
        sparse: how the prefix was read; None if every token sees all earlier ones.

    Attributes:
        windows: sizes of the windows and chunks that the model's masks had, in tokens.
    """

    def __init__(
        self,
        config: Any,
        n_prefix: int,
        device: torch.device,
        seen: Sequence[int] = (),
        sparse: SparseReading | None = None,
    ) -> None:
        self.windows: set[int] = set()
        self._config = config
        self._n_prefix = n_prefix
        is_cut = any(length < n_prefix for length in seen)
        self._seen = torch.tensor(seen, device=device) if is_cut else None
        # Branch of each token behind the prefix.
        self._branches = torch.empty(0, dtype=torch.long, device=device)
        # Position of every token, the prefix's too, in prefix and branch.
        self._positions = torch.arange(n_prefix, device=device)
        self._window = None if sparse is None else sparse.window
        self._layout = Layout.empty(device)
        if sparse is not None and self._window is not None:  # not all is stored
            self._layout = sparse.layout
            self._positions = sparse.layout.number
            self._n_prefix = len(self._positions)
        self._n_new = 0
        self._n_calls = 0

    @contextmanager
    def appended(
        self, branches: Sequence[int], n_before: Sequence[int], positions: Tensor
    ) -> Iterator[None]:
        """Attend this way within the context, in which the decoder is given more tokens once.

        Args:
            branches: the branch of each token.
            n_before: number of tokens before each in its branch and the prefix.
            positions: their positions, (1, tokens) or (3, 1, tokens).

        Raises:
            CannotAttendError: the decoder has layers that do not attend by transformers' interface,
                or with masks that are not made by transformers' functions of positions.
        """
        new = torch.tensor([branches, n_before]).to(self._branches.device)
        self._branches = torch.cat((self._branches, new[0]))
        self._positions = torch.cat((self._positions, new[1]))
        if self._window is not None:
            self._layout += Layout.of_words(new[1], positions)
        self._n_new = len(branches)
        self._n_calls = 0
        with attending(self._config, f"branches_{id(self)}", self._attention, self._mask):
            yield
        if self._n_calls != self._config.num_hidden_layers:
            raise CannotAttendError(
                "the model's layers do not all attend by transformers' interface; set batch_size=1"
            )

    def _attention(
        self,
        module: Any,
        query: Tensor,
        key: Tensor,
        value: Tensor,
        attention_mask: Tensor | None,
        *,
        scaling: float | None = None,
        **others: Any,
    ) -> tuple[Tensor, None]:
        """Return the attention of the new tokens, in the form of transformers' attention functions.

        Args:
            module: attention module of the layer.
            query: queries, (1, heads, new tokens, head size).
            key: keys, (1, key heads, all tokens, head size).
            value: values, like `key`.
            attention_mask: what `_mask` returned, handed on by the model.
            scaling: factor of the dot products; by the head size where None.
            others: settings of some models. Windows are among them, which the mask has already.

        Returns:
            The outputs, (1, new tokens, heads, head size), and None instead of weights.

        Raises:
            CannotAttendError: the model adds something to the scores, or gives a layer no mask.
        """
        mask = require_plain(attention_mask, others, _HINT)
        self._n_calls += 1
        n_key_heads = key.shape[1]
        # Heads that share keys become the second axis, along which a view repeats keys without a
        # copy.
        shared = (n_key_heads, query.shape[1] // n_key_heads)
        if self._window is not None:
            rows = self._layout[-self._n_new :]
            output = self._window.part(rows, self._layout, mask[0, 0])(
                module.layer_idx,
                query.unflatten(1, shared)[0],
                key[0, :, None],
                value[0, :, None],
                scaling,
            )
            return output.flatten(0, 1).transpose(0, 1)[None], None
        seen = mask[0, 0].to(query.device)  # a model can be on several devices
        among = Keys(key[0, :, None], value[0, :, None], seen)
        output = attend(query.unflatten(1, shared)[0], among, scaling)
        return output.flatten(0, 1).transpose(0, 1)[None], None

    def _mask(
        self,
        *,
        mask_function: MaskFunction,
        use_vmap: bool = False,
        local_size: int | None = None,
        **others: Any,
    ) -> Tensor:
        """Return which tokens the new ones attend to, (1, 1, new tokens, all tokens), true or
        false, in the form of transformers' mask functions.

        Args:
            mask_function: whether a token attends to another, by batch, head and both positions.
            use_vmap: true if the model adds a rule of its own, which may go by more than positions.
            local_size: the model's window or chunk in tokens, None without.
            others: sizes of the sequence, which are known here.

        Raises:
            CannotAttendError: the model adds a rule of its own.
        """
        if use_vmap:
            raise CannotAttendError("the model adds rules of its own to masks; set batch_size=1")
        if local_size is not None:
            self.windows.add(local_size)
        new_ones = self._positions[-self._n_new :]
        seen = seen_by(mask_function, new_ones, self._positions).contiguous()[None, None]
        # In place, because a copy for every token would be as long as the context.
        new = self._branches[-self._n_new :, None]
        seen[..., self._n_prefix :] &= self._branches == new
        if self._seen is not None:
            seen[..., : self._n_prefix] &= self._positions[: self._n_prefix] < self._seen[new]
        return seen
