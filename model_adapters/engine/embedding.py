"""From units of a prompt to the embeddings and positions that a language model is fed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch

from infthor_eval.errors import ModelError
from model_adapters.engine.family import Family
from model_adapters.engine.features import FeatureCache
from model_adapters.engine.prompt import Frame, Unit

__all__ = ["Embedded", "Embedder"]


@dataclass(frozen=True)
class Embedded:
    """A piece of a prompt, ready to be fed.

    Attributes:
        embeds: (tokens, hidden).
        positions: (1, tokens) or (3, 1, tokens).
        starts: the position of each unit's first token.
        end: the position of what follows.
    """

    embeds: torch.Tensor
    positions: torch.Tensor
    starts: tuple[int, ...]
    end: int


class Embedder:
    """Embeds pieces of prompts for one model.

    Args:
        model: a transformers model.
        family: its family.
        features: where the frames' features come from.
    """

    def __init__(self, model: Any, family: Family, features: FeatureCache) -> None:
        self._family = family
        self._features = features
        self._embeddings = model.get_input_embeddings()

    @torch.inference_mode()
    def __call__(self, units: Sequence[Unit], start: int) -> Embedded:
        """Embed units whose first token takes the position `start`.

        Raises:
            DataError: a frame cannot be read.
            ModelError: processor and model disagree on how many tokens a frame takes.
        """
        frames = [unit for unit in units if isinstance(unit, Frame)]
        flat: list[int] = []
        slots: list[int] = []
        firsts: list[int] = []
        for unit in units:
            firsts.append(len(flat))
            if isinstance(unit, int):
                flat.append(unit)
            else:
                slots.extend(len(flat) + at for at, token in enumerate(unit.ids) if token == self._family.slot_id)
                flat.extend(unit.ids)
        ids = torch.tensor(flat, device=self._embeddings.weight.device)
        embeds = self._embeddings(ids)
        if frames:
            features = torch.cat(self._features.get(frames))
            if len(features) != len(slots):
                raise ModelError(
                    f"the processor makes {len(slots)} image tokens of {len(frames)} frames and the model "
                    f"{len(features)} features; they do not belong to one checkpoint"
                )
            embeds[slots] = features.to(embeds.dtype)
        positions = self._family.positions(ids, [frame.size for frame in frames], start)
        # A unit's first token has the same position on every axis; the next unit starts behind the largest one.
        axes = positions.reshape(-1, len(flat))
        first = axes[0].tolist()
        return Embedded(embeds, positions, tuple(first[at] for at in firsts), int(axes.max()) + 1)
