"""From pieces of a prompt to the embeddings and positions that a language model reads."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch

from infthor_eval.errors import ModelError
from model_adapters.hf.family import Family
from model_adapters.hf.prompting.features import FeatureCache
from model_adapters.hf.prompting.prompt import Clip, Frame, Piece

__all__ = ["EmbeddedSpan", "Embedder"]


@dataclass(frozen=True)
class EmbeddedSpan:
    """A span of a prompt as input of the language model.

    Attributes:
        embeds: embeddings, (tokens, hidden), on the embedding layer's device.
        positions: position ids, (1, tokens) or (3, 1, tokens), on the same device.
        starts: position behind everything before each piece, which is that of the first token of a
            text or a frame.
        end: position of the token that follows the span.
    """

    embeds: torch.Tensor
    positions: torch.Tensor
    starts: tuple[int, ...]
    end: int


class Embedder:
    """Embeds spans of prompts for one model, with a cache of features of frames and clips."""

    def __init__(self, model: Any, family: Family, features: FeatureCache) -> None:
        self._family = family
        self._features = features
        self._embeddings = model.get_input_embeddings()

    @torch.inference_mode()
    def __call__(self, pieces: Sequence[Piece], start: int) -> EmbeddedSpan:
        """Embed pieces that begin at the position `start`, behind everything before them.

        Raises:
            DataError: a frame cannot be read.
            ModelError: processor and model disagree on the number of a frame's tokens.
        """
        visuals = [piece for piece in pieces if not isinstance(piece, int)]
        flat: list[int] = []
        slots: list[int] = []
        firsts: list[int] = []
        for piece in pieces:
            firsts.append(len(flat))
            if isinstance(piece, int):
                flat.append(piece)
            else:
                # All tokens of a clip are slots; a frame can have tokens of text among them.
                is_slot = [
                    isinstance(piece, Clip) or token == self._family.slot_id for token in piece.ids
                ]
                slots.extend(len(flat) + at for at, slot in enumerate(is_slot) if slot)
                flat.extend(piece.ids)
        # Features first: reading and scaling of frames on the CPU overlaps with the device's
        # previous chunk.
        features = self._slot_features(visuals, len(slots)) if visuals else None
        device = self._embeddings.weight.device
        # Positions are computed on the CPU, because reading them below would otherwise wait for the
        # device.
        ids = torch.tensor(flat)
        positions = self._family.positions(ids, [piece.shape for piece in visuals], start)
        embeds = self._embeddings(ids.to(device))
        if features is not None:
            embeds[slots] = features.to(embeds)
        # A piece starts behind the largest position before it, on any axis.
        largest = positions.reshape(-1, len(flat)).amax(dim=0).cummax(dim=0).values
        behind = [start, *(largest + 1).tolist()]
        return EmbeddedSpan(
            embeds, positions.to(device), tuple(behind[at] for at in firsts), behind[-1]
        )

    @torch.inference_mode()
    def words(self, tokens: Sequence[int], starts: Sequence[int]) -> EmbeddedSpan:
        """Embed tokens of text of different sequences, each of which begins at its own position."""
        ids = torch.tensor(tokens)
        positions = torch.empty_like(self._family.positions(ids, [], 0)).copy_(torch.tensor(starts))
        device = self._embeddings.weight.device
        ends = tuple(start + 1 for start in starts)
        return EmbeddedSpan(
            self._embeddings(ids.to(device)), positions.to(device), tuple(starts), max(ends)
        )

    def _slot_features(self, visuals: Sequence[Frame | Clip], n_slots: int) -> torch.Tensor:
        features = torch.cat(self._features.get(visuals))
        if len(features) != n_slots:
            raise ModelError(
                f"the processor makes {n_slots} image tokens of {len(visuals)} frames and the "
                f"model {len(features)} features; they do not belong to one checkpoint"
            )
        return features
