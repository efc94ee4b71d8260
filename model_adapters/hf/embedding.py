"""From pieces of a prompt to the embeddings and positions that a language model reads."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch

from infthor_eval.errors import ModelError
from model_adapters.hf.family import Family
from model_adapters.hf.features import FeatureCache
from model_adapters.hf.prompt import Frame, Piece

__all__ = ["EmbeddedSpan", "Embedder"]


@dataclass(frozen=True)
class EmbeddedSpan:
    """A span of a prompt as input of the language model.

    Attributes:
        embeds: embeddings, (tokens, hidden), on the embedding layer's device.
        positions: position ids, (1, tokens) or (3, 1, tokens), on the same device.
        starts: position of the first token of each piece.
        end: position of the token that follows the span.
    """

    embeds: torch.Tensor
    positions: torch.Tensor
    starts: tuple[int, ...]
    end: int


class Embedder:
    """Embeds spans of prompts for one model of a family, with a cache of the frames' features."""

    def __init__(self, model: Any, family: Family, features: FeatureCache) -> None:
        self._family = family
        self._features = features
        self._embeddings = model.get_input_embeddings()

    @torch.inference_mode()
    def __call__(self, pieces: Sequence[Piece], start: int) -> EmbeddedSpan:
        """Embed pieces whose first token has the position `start`.

        Raises:
            DataError: a frame cannot be read.
            ModelError: processor and model disagree on the number of a frame's tokens.
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
        # Features first: reading and scaling of frames on the CPU overlaps with the device's previous chunk.
        features = self._slot_features(frames, len(slots)) if frames else None
        device = self._embeddings.weight.device
        # Positions are computed on the CPU, because reading them below would otherwise wait for the device.
        ids = torch.tensor(flat)
        positions = self._family.positions(ids, [frame.size for frame in frames], start)
        embeds = self._embeddings(ids.to(device))
        if features is not None:
            embeds[slots] = features.to(embeds)
        # A piece's first token has the same position on every axis; the next piece starts behind the largest one.
        axes = positions.reshape(-1, len(flat))
        first = axes[0].tolist()
        return EmbeddedSpan(embeds, positions.to(device), tuple(first[at] for at in firsts), int(axes.max()) + 1)

    def _slot_features(self, frames: Sequence[Frame], n_slots: int) -> torch.Tensor:
        features = torch.cat(self._features.get(frames))
        if len(features) != n_slots:
            raise ModelError(
                f"the processor makes {n_slots} image tokens of {len(frames)} frames and the model "
                f"{len(features)} features; they do not belong to one checkpoint"
            )
        return features
