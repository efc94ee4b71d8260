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
    Plan,
    attending,
    by_mask,
    seen_by,
)
from model_adapters.hf.sparse.layout import Layout
from model_adapters.hf.sparse.reading import SparseReading


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
            CannotAttendError: the decoder attends in another way; see `attending`.
        """
        new = torch.tensor([branches, n_before]).to(self._branches.device)
        self._branches = torch.cat((self._branches, new[0]))
        self._positions = torch.cat((self._positions, new[1]))
        if self._window is not None:
            self._layout += Layout.of_words(new[1], positions)
        self._n_new = len(branches)
        with attending(self._config, positions.device, self._plan, "set batch_size=1"):
            yield

    def _plan(self, mask_function: MaskFunction, local_size: int | None) -> Plan:
        """Return the attention of the new tokens, each of which sees its branch and the prefix as
        far as a rule lets it."""
        if local_size is not None:
            self.windows.add(local_size)
        new_ones = self._positions[-self._n_new :]
        seen = seen_by(mask_function, new_ones, self._positions).contiguous()
        # In place, because a copy for every token would be as long as the context.
        new = self._branches[-self._n_new :, None]
        seen[:, self._n_prefix :] &= self._branches == new
        if self._seen is not None:
            seen[:, : self._n_prefix] &= self._positions[: self._n_prefix] < self._seen[new]
        if self._window is None:
            return by_mask(seen)
        return self._window.part(self._layout[-self._n_new :], self._layout, seen)
