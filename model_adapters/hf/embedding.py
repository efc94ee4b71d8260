"""From pieces of a prompt to the embeddings and positions that a language model is fed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch

from infthor_eval.errors import ModelError
from model_adapters.hf.family import Family
from model_adapters.hf.features import FeatureCache
from model_adapters.hf.prompt import Frame, Piece

__all__ = ["Embedded", "Embedder"]


@dataclass(frozen=True)
class Embedded:
    """A stretch of a prompt, ready to be fed.

    Attributes:
        embeds: (tokens, hidden), on the embedding layer's device.
        positions: (1, tokens) or (3, 1, tokens), there too.
        starts: the position of each piece's first token.
        end: the position of what follows.
    """

    embeds: torch.Tensor
    positions: torch.Tensor
    starts: tuple[int, ...]
    end: int


class Embedder:
    """Embeds stretches of prompts for one model.

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
    def __call__(self, pieces: Sequence[Piece], start: int) -> Embedded:
        """Embed pieces whose first token takes the position `start`.

        Raises:
            DataError: a frame cannot be read.
            ModelError: processor and model disagree on how many tokens a frame takes.
        """
        frames = [piece for piece in pieces if isinstance(piece, Frame)]
        flat: list[int] = []
        slots: list[int] = []
        firsts: list[int] = []
        for piece in pieces:
            firsts.append(len(flat))
            if isinstance(piece, int):
                flat.append(piece)
            else:
                slots.extend(len(flat) + at for at, token in enumerate(piece.ids) if token == self._family.slot_id)
                flat.extend(piece.ids)
        # Features first: their frames are read and scaled here while the device still computes what came before.
        features = self._features_of(frames, len(slots)) if frames else None
        device = self._embeddings.weight.device
        # Positions are made here, where they can be looked at without waiting for the device.
        ids = torch.tensor(flat)
        positions = self._family.positions(ids, [frame.size for frame in frames], start)
        embeds = self._embeddings(ids.to(device))
        if features is not None:
            embeds[slots] = features.to(embeds)
        # A piece's first token has the same position on every axis; the next piece starts behind the largest one.
        axes = positions.reshape(-1, len(flat))
        first = axes[0].tolist()
        return Embedded(embeds, positions.to(device), tuple(first[at] for at in firsts), int(axes.max()) + 1)

    def _features_of(self, frames: Sequence[Frame], n_slots: int) -> torch.Tensor:
        features = torch.cat(self._features.get(frames))
        if len(features) != n_slots:
            raise ModelError(
                f"the processor makes {n_slots} image tokens of {len(frames)} frames and the model "
                f"{len(features)} features; they do not belong to one checkpoint"
            )
        return features
