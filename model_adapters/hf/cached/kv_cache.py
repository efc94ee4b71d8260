"""A KV cache that is cut and refilled in place.

transformers' DynamicCache concatenates, which copies the whole prefix for every decoded token and
again after every crop. Here keys and values are views on buffers with spare capacity: an update
writes its own rows only, and a crop moves no memory, so rewinding a conversation costs nothing.
"""

import inspect
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch
from transformers.cache_utils import (
    DYNAMIC_LAYER_TYPE_MAPPING,
    Cache,
    DynamicLayer,
    LinearAttentionLayer,
    get_layer_types_and_kwargs,
)

# capacities are multiples of this, so that a slightly longer question does not reallocate the
# prefix
_STEP = 1024
_MOST = 4  # marks; those of the longest unused are dropped
_States = list[dict[str, dict[int, Any]]]
_FIELDS = (
    "conv_states",
    "recurrent_states",
    "is_conv_states_initialized",
    "is_recurrent_states_initialized",
    "has_previous_state",
    "conv_kernel_size",
)


def cache_arguments(model: Any, cache: Cache) -> dict[str, Any]:
    """Return the arguments by which a model extends a cache; transformers 5.24 has renamed one."""
    is_new = "cache" in inspect.signature(type(model).forward).parameters
    return {"cache" if is_new else "past_key_values": cache, "use_cache": True}


@dataclass
class _Allocation:
    """Allocation settings that a cache shares with its layers.

    Layers do not refer to the cache itself: in a reference cycle, unused buffers would stay in
    memory beside their successors until Python's cyclic garbage collector runs.
    """

    # Device of the buffers; the device of the layers' weights where None.
    storage: torch.device | None
    capacity: int = 0  # tokens that a buffer holds when it is next allocated


class BufferedCache(Cache):
    """A cache of `BufferedLayer`s, which are created as the model reaches its layers.

    Layers without keys, of linear attention or convolutions, have transformers' own caches.
    """

    def __init__(self, config: Any, storage: torch.device | None = None) -> None:
        """Create an empty cache for a decoder with this config, with buffers on the device
        `storage`, or the weights' where None.

        With the CPU as storage, only the computing layer's keys and values are on the weights'
        device: a context that does not fit on the device runs, at the speed of the connection.
        """
        self._allocation = _Allocation(storage)
        self._linear = _linear_layers(config)
        self._states = _LinearStates([*self._linear.values()]) if self._linear else None
        self._n_dropped = 0
        super().__init__(layers=[])
        if self._linear:  # masks of such a model are made by its first layer that attends
            self._create_layers(config.num_hidden_layers)

    def update(
        self,
        key_states: torch.Tensor,
        value_states: torch.Tensor,
        layer_idx: int,
        *args: Any,
        **kwargs: Any,
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Append one layer's new states to its old ones and return all."""
        self._create_layers(layer_idx + 1)
        return super().update(key_states, value_states, layer_idx, *args, **kwargs)

    @property
    def n_read(self) -> int:
        """Tokens of the sequence, with those that were dropped."""
        return self.get_seq_length() + self._n_dropped

    def reserve(self, n_tokens: int) -> None:
        """Set the capacity of buffers allocated from now on, so that they need not grow."""
        self._allocation.capacity = -(-n_tokens // _STEP) * _STEP

    @torch.inference_mode()
    def drop(self, begin: int, end: int) -> None:
        """Forget the stored tokens of these places; memory stays allocated."""
        for layer in self.layers:
            if isinstance(layer, BufferedLayer) and end > begin:
                layer.drop(begin, end)
        self._n_dropped += end - begin

    def lengthen(self, n_tokens: int) -> None:
        """Append so many tokens to every layer with keys, each with the keys and values of the last
        one: for measuring memory, not for replies."""
        for layer in self.layers:
            if isinstance(layer, BufferedLayer) and layer.keys is not None:
                assert layer.values is not None  # both or none
                layer.update(_repeated(layer.keys, n_tokens), _repeated(layer.values, n_tokens))

    @property
    def needs_marks(self) -> bool:
        """True if the cache can be cut at marks and its end alone."""
        return self._states is not None

    def mark(self) -> None:
        """Let the cache be cut here later, if it needs marks."""
        if self._states is not None:
            self._states.mark(self.n_read)

    def cut_before(self, n_tokens: int) -> int:
        """Return the most tokens, of so many, behind which the cache can be cut."""
        if self._states is None or n_tokens == self.n_read:
            return n_tokens
        return self._states.nearest(n_tokens)

    def truncate(self, n_tokens: int) -> None:
        """Keep the first `n_tokens` tokens, one of the numbers of `cut_before`; memory stays
        allocated."""
        excess = self.n_read - n_tokens
        if excess <= 0:
            return
        if not n_tokens:
            excess -= self._n_dropped
            self._n_dropped = 0
        for layer in self.layers:
            if isinstance(layer, BufferedLayer):
                layer.crop(-excess)
        if self._states is not None:
            self._states.restore(n_tokens)

    def _create_layers(self, n_layers: int) -> None:
        for number in range(len(self.layers), n_layers):
            self.layers.append(self._linear.get(number) or BufferedLayer(self._allocation))


def _repeated(states: torch.Tensor, n_tokens: int) -> torch.Tensor:
    """Return the last token's states so many times, as a view."""
    return states[..., -1:, :].expand(*states.shape[:-2], n_tokens, states.shape[-1])


class BufferedLayer(DynamicLayer):
    """Keys and values of one layer; `keys` and `values` are views on the used part of the buffers.

    Buffers have the shape (batch, heads, capacity, head size).
    """

    keys: torch.Tensor
    values: torch.Tensor

    def __init__(self, allocation: _Allocation) -> None:
        super().__init__()
        self._allocation = allocation
        self._buffers: tuple[torch.Tensor, torch.Tensor] | None = None

    def update(
        self, key_states: torch.Tensor, value_states: torch.Tensor, *args: Any, **kwargs: Any
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Append the new states to the old ones and return all, on the states' device."""
        if not self.is_initialized:
            self.lazy_initialization(key_states, value_states)
        old = self.get_seq_length()
        new = old + key_states.shape[-2]
        if self._buffers is None or self._buffers[0].shape[-2] < new:
            capacity = max(new, self._allocation.capacity)
            self._buffers = (
                self._grow(key_states, old, capacity, self.keys),
                self._grow(value_states, old, capacity, self.values),
            )
        keys, values = self._buffers
        keys[..., old:new, :] = key_states
        values[..., old:new, :] = value_states
        self.keys = keys[..., :new, :]
        self.values = values[..., :new, :]
        return self.keys.to(key_states.device), self.values.to(value_states.device)

    @property
    def n_bytes(self) -> int:
        """Bytes of the buffers."""
        return sum(buffer.nbytes for buffer in self._buffers or ())

    def drop(self, begin: int, end: int) -> None:
        """Forget the tokens of these places."""
        assert self._buffers is not None  # there are tokens
        n_kept = self.get_seq_length() - (end - begin)
        for buffer, used in zip(self._buffers, (self.keys, self.values), strict=True):
            buffer[..., begin:n_kept, :] = used[..., end:, :].clone()
        self.keys, self.values = (buffer[..., :n_kept, :] for buffer in self._buffers)

    def _grow(
        self, like: torch.Tensor, old: int, capacity: int, used: torch.Tensor | None
    ) -> torch.Tensor:
        device = self._allocation.storage or like.device
        buffer = like.new_empty((*like.shape[:-2], capacity, like.shape[-1]), device=device)
        if used is not None and old:
            buffer[..., :old, :] = used
        return buffer


def _linear_layers(config: Any) -> dict[int, LinearAttentionLayer]:
    """Return an empty cache of each of a decoder's layers that has no keys, by its number.

    There are none in a decoder whose layers all attend.
    """
    types, settings = get_layer_types_and_kwargs(config)
    layers = {}
    for number, (layer_type, options) in enumerate(zip(types, settings, strict=True)):
        if DYNAMIC_LAYER_TYPE_MAPPING.get(layer_type) is LinearAttentionLayer:
            layers[number] = LinearAttentionLayer(**options)
    return layers


class _LinearStates:
    """The states of a cache's linear layers, at the end and at marks.

    Layers with linear attention or convolutions have one state for all that they have read, which
    cannot be cut behind any token. So copies are kept at marks, and a cache goes back to the last
    mark before the token that it is cut behind; what is between is read again.

    Args:
        layers: caches of the layers.
    """

    def __init__(self, layers: Sequence[LinearAttentionLayer]) -> None:
        self._layers = layers
        self._marks: OrderedDict[int, _States] = OrderedDict()
        self.mark(0)

    def mark(self, n_tokens: int) -> None:
        """Keep a copy of the states, which are those behind so many tokens."""
        self._marks[n_tokens] = [_copy(vars(layer)) for layer in self._layers]
        self._marks.move_to_end(n_tokens)
        self._marks.move_to_end(0)  # the beginning is never dropped
        while len(self._marks) > _MOST:
            self._marks.popitem(last=False)

    def nearest(self, n_tokens: int) -> int:
        """Return the tokens of the last mark that is not behind so many."""
        return max(mark for mark in self._marks if mark <= n_tokens)

    def restore(self, mark: int) -> None:
        """Go back to the states at a mark; later marks are dropped."""
        for layer, states in zip(self._layers, self._marks[mark], strict=True):
            vars(layer).update(_copy(states))
        for later in [one for one in self._marks if one > mark]:
            del self._marks[later]
        self._marks.move_to_end(mark)


def _copy(states: dict[str, Any]) -> dict[str, dict[int, Any]]:
    return {
        name: {
            number: value.clone() if isinstance(value, torch.Tensor) else value
            for number, value in states[name].items()
        }
        for name in _FIELDS
    }
