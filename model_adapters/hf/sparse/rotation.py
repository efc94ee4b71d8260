"""Turning queries and keys to other positions, for models with rotary positions."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from infthor_eval.errors import ModelError
from model_adapters.hf.cached.kv_cache import BufferedCache, cache_arguments
from model_adapters.hf.prompting.embedding import Embed
from model_adapters.hf.sparse.interface import attending

_MOVED = 7  # positions that a sample is moved by
_TOLERANCE = 0.02  # of the largest value; of half precision
_HINT = "use positions=absolute, or another attention"


@dataclass(frozen=True)
class Rotation:
    """How a layer turns by positions.

    Attributes:
        frequencies: angle by position of each pair of values, (pairs,); none of a layer without
            positions.
        interleaved: True if the values of a pair are neighbours, False if they are half of all that
            turn apart.
    """

    frequencies: Tensor
    interleaved: bool = False

    def turn(self, states: Tensor, moved: Tensor) -> Tensor:
        """Return queries or keys as they are at positions so many farther.

        Turning all axes of a position by the same is turning by one: axes share the frequencies.

        Args:
            states: (..., tokens, head size).
            moved: (tokens,).
        """
        n_pairs = len(self.frequencies)
        if not n_pairs:
            return states
        angles = moved.double()[:, None] * self.frequencies.double()
        cos = angles.cos().to(states)
        sin = angles.sin().to(states)
        turning, rest = states.split([2 * n_pairs, states.shape[-1] - 2 * n_pairs], dim=-1)
        axis = -1 if self.interleaved else -2
        first, second = self._paired(turning).unbind(axis)
        turned = torch.stack((first * cos - second * sin, second * cos + first * sin), dim=axis)
        return torch.cat((turned.flatten(-2), rest), dim=-1)

    def _paired(self, states: Tensor) -> Tensor:
        n_pairs = len(self.frequencies)
        return states.unflatten(-1, (n_pairs, 2) if self.interleaved else (2, n_pairs))


@torch.inference_mode()
def find_rotations(model: Any, embed: Embed) -> list[Rotation]:
    """Return how each layer turns, by what its keys of a word are at two positions.

    Raises:
        ModelError: a layer turns in another way.
    """
    here, moved = (_keys(model, embed, position) for position in (0, _MOVED))
    buffers = model.get_decoder().named_buffers()
    known = [buffer.flatten() for name, buffer in buffers if name.endswith("inv_freq")]
    ways = [Rotation(known[0].new_empty(0))] if known else [Rotation(torch.empty(0))]
    ways += [Rotation(each, side) for each in known for side in (False, True)]
    return [_way(ways, *keys) for keys in zip(here, moved, strict=True)]


def _way(ways: Sequence[Rotation], here: Tensor, moved: Tensor) -> Rotation:
    distance = torch.tensor([_MOVED], device=here.device)
    for way in ways:
        fits = 2 * len(way.frequencies) <= here.shape[-1]
        if fits and (way.turn(here, distance) - moved).abs().max() <= _TOLERANCE * here.abs().max():
            return way
    raise ModelError(f"the model's positions are none that can be turned; {_HINT}")


def _keys(model: Any, embed: Embed, position: int) -> list[Tensor]:
    """Return the keys of a word in each layer, (key heads, 1, 1, head size)."""
    found: list[Tensor] = []

    def attend(
        _layer: int, query: Tensor, key: Tensor, value: Tensor, _scale: float | None
    ) -> Tensor:
        found.append(key.float())
        return value.expand_as(query)  # it sees itself alone

    config = model.get_decoder().config
    span = embed.words([0], [position])
    with attending(config, span.positions.device, lambda *_: attend, _HINT):
        model(
            **span.inputs,
            position_ids=span.positions,
            **cache_arguments(model, BufferedCache(config)),
            logits_to_keep=1,
        )
    return found
