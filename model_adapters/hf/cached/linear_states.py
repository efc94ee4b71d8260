"""States of layers with linear attention or convolutions, which cannot be cut behind any token.

Such a layer has one state for all that it has read. So copies are kept at marks, and a cache goes
back to the last mark before the token that it is cut behind; what is between is read again.
"""

from collections import OrderedDict
from collections.abc import Sequence
from typing import Any

import torch
from transformers.cache_utils import (
    DYNAMIC_LAYER_TYPE_MAPPING,
    LinearAttentionLayer,
    get_layer_types_and_kwargs,
)

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


def linear_layers(config: Any) -> dict[int, LinearAttentionLayer]:
    """Return an empty cache of each of a decoder's layers that has no keys, by its number.

    There are none in a decoder whose layers all attend.
    """
    types, settings = get_layer_types_and_kwargs(config)
    layers = {}
    for number, (layer_type, options) in enumerate(zip(types, settings, strict=True)):
        if DYNAMIC_LAYER_TYPE_MAPPING.get(layer_type) is LinearAttentionLayer:
            layers[number] = LinearAttentionLayer(**options)
    return layers


class LinearStates:
    """The states of a cache's linear layers, at the end and at marks.

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
