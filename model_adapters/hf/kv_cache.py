"""A KV cache that is cut and refilled in place.

transformers' DynamicCache concatenates, which copies the whole prefix for every decoded token and again after every
crop. Here keys and values lie in buffers with room at the end: an update writes its own rows only, and a crop moves
no memory at all.
"""

from dataclasses import dataclass
from typing import Any

import torch
from transformers.cache_utils import Cache, DynamicLayer

__all__ = ["BufferedCache"]

_STEP = 1024  # buffers end at multiples of this, so that questions of slightly different length find room


@dataclass
class _Wanted:
    """What the layers of a cache have to know of it.

    They do not hold the cache itself: in a circle of references, buffers that nobody uses any more would stay in memory
    beside their successors until Python's collector comes by.

    Attributes:
        storage: where buffers lie; beside the layers' weights where None.
        room: tokens that a layer which has to grow should hold.
    """

    storage: torch.device | None
    room: int = 0


class BufferedCache(Cache):
    """A cache of `BufferedLayer`s that are made as the model comes to its layers."""

    def __init__(self, storage: torch.device | None = None) -> None:
        """Make an empty cache.

        Args:
            storage: where the buffers lie; beside the layers' weights where None. With the CPU as storage, a layer's
                keys and values are copied to the weights' device while the layer computes, and to nowhere else: a
                context that does not fit on the device runs, at the speed of the connection.
        """
        self._wanted = _Wanted(storage)
        super().__init__(layers=[])

    def update(
        self,
        key_states: torch.Tensor,
        value_states: torch.Tensor,
        layer_idx: int,
        *args: Any,
        **kwargs: Any,
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Write one layer's new states behind its old ones and return all."""
        while len(self.layers) <= layer_idx:
            self.layers.append(BufferedLayer(self._wanted))
        return super().update(key_states, value_states, layer_idx, *args, **kwargs)

    def reserve(self, n_tokens: int) -> None:
        """Say how long the sequence will become, so that buffers are allocated once and at the right size."""
        self._wanted.room = -(-n_tokens // _STEP) * _STEP

    def truncate(self, n_tokens: int) -> None:
        """Keep the first `n_tokens` tokens; memory stays allocated."""
        excess = self.get_seq_length() - n_tokens
        if excess > 0:
            self.crop(-excess)

    def spread(self, n_rows: int, room: int) -> "BufferedCache":
        """A new cache that holds this one's single sequence in each of its rows, with room for `room` tokens."""
        spread = BufferedCache(self._wanted.storage)
        spread.reserve(room)
        for index, layer in enumerate(self.layers):
            if isinstance(layer, BufferedLayer) and layer.keys is not None and layer.values is not None:
                spread.update(layer.keys.expand(n_rows, -1, -1, -1), layer.values.expand(n_rows, -1, -1, -1), index)
        return spread


class BufferedLayer(DynamicLayer):
    """Keys and values of one layer, `keys` and `values` being views on the used part of the buffers.

    Buffers have the shape (batch, heads, room, head size).
    """

    def __init__(self, wanted: _Wanted) -> None:
        super().__init__()
        self._wanted = wanted
        self._buffers: tuple[torch.Tensor, torch.Tensor] | None = None

    def update(
        self,
        key_states: torch.Tensor,
        value_states: torch.Tensor,
        *args: Any,
        **kwargs: Any,
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Write the new states behind the old ones and return all, on the states' device."""
        if not self.is_initialized:
            self.lazy_initialization(key_states, value_states)
        old = self.get_seq_length()
        new = old + key_states.shape[-2]
        if self._buffers is None or self._buffers[0].shape[-2] < new:
            room = max(new, self._wanted.room)
            self._buffers = (
                self._grown(key_states, old, room, self.keys),
                self._grown(value_states, old, room, self.values),
            )
        keys, values = self._buffers
        keys[..., old:new, :] = key_states
        values[..., old:new, :] = value_states
        self.keys, self.values = keys[..., :new, :], values[..., :new, :]
        return self.keys.to(key_states.device), self.values.to(value_states.device)

    def _grown(self, like: torch.Tensor, old: int, room: int, used: torch.Tensor | None) -> torch.Tensor:
        device = self._wanted.storage or like.device
        buffer = like.new_empty((*like.shape[:-2], room, like.shape[-1]), device=device)
        if used is not None and old:
            buffer[..., :old, :] = used
        return buffer
