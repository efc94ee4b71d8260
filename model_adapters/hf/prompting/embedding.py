"""From pieces of a prompt to the inputs that a language model reads."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import torch

from infthor_eval.errors import ModelError
from model_adapters.hf.family import Family
from model_adapters.hf.prompting.features import FeatureCache
from model_adapters.hf.prompting.prompt import Clip, Frame, Piece, width


@dataclass(frozen=True)
class Span:
    """A span of a prompt as input of the model.

    Attributes:
        inputs: the model's inputs but for positions and cache, with a batch axis of 1.
        positions: position ids, (1, tokens) or (3, 1, tokens), on the weights' device.
        starts: position behind everything before each piece, which is that of the first token of a
            text or a frame.
        end: position of the token that follows the span.
    """

    inputs: Mapping[str, Any]
    positions: torch.Tensor
    starts: tuple[int, ...]
    end: int

    @property
    def n_tokens(self) -> int:
        """Tokens of the span."""
        return self.positions.shape[-1]


class Embed(ABC):
    """Prepares spans of prompts for one model, with a cache of features of frames and clips."""

    def __init__(self, model: Any, family: Family, features: FeatureCache[Any]) -> None:
        self._family = family
        self._features = features
        self._embeddings = model.get_input_embeddings()

    @property
    @abstractmethod
    def sees_ahead(self) -> bool:
        """True if tokens of a frame attend to later ones of the same frame."""

    @abstractmethod
    def __call__(self, pieces: Sequence[Piece], start: int, before: Sequence[Piece]) -> Span:
        """Prepare pieces that begin at the position `start`, behind the pieces `before` them."""

    @abstractmethod
    def words(self, tokens: Sequence[int], starts: Sequence[int]) -> Span:
        """Prepare tokens of text of different sequences, each at its own position."""

    @abstractmethod
    def join(self, spans: Sequence[Span]) -> Mapping[str, Any]:
        """Return the inputs of several spans as those of one sequence."""

    def expect(self, pieces: Sequence[Piece]) -> None:
        """Begin to read the frames of pieces that are going to be prepared, in this order."""
        self._features.expect(_visuals(pieces))

    def hash(self, pieces: Sequence[Piece]) -> str:
        """Return the hash of the pixels of the frames of pieces that were prepared."""
        return self._features.hash(_visuals(pieces))

    def clear(self) -> None:
        """Free the memory of cached features."""
        self._features.clear()

    def close(self) -> None:
        """End the threads that read frames."""
        self._features.close()

    @property
    def _device(self) -> torch.device:
        return self._embeddings.weight.device


def _visuals(pieces: Sequence[Piece]) -> list[Frame | Clip]:
    return [piece for piece in pieces if not isinstance(piece, int)]


def piece_starts(
    pieces: Sequence[Piece], positions: torch.Tensor, start: int
) -> tuple[tuple[int, ...], int]:
    """Return the position behind everything before each piece, and behind all of them.

    A piece starts behind the largest position before it, on any axis.

    Args:
        pieces: pieces of a span.
        positions: positions of their tokens, (1, tokens) or (3, 1, tokens), on the CPU.
        start: position behind everything before the span.
    """
    largest = positions.reshape(-1, positions.shape[-1]).amax(dim=0).cummax(dim=0).values
    behind = [start, *(largest + 1).tolist()]
    starts = []
    at = 0
    for piece in pieces:
        starts.append(behind[at])
        at += width(piece)
    return tuple(starts), behind[-1]


def word_span(
    family: Family,
    inputs: Mapping[str, Any],
    ids: torch.Tensor,
    starts: Sequence[int],
    device: torch.device,
) -> Span:
    """Return tokens of text of different sequences, each at its own position, with these inputs."""
    positions = torch.empty_like(family.positions(ids, [], 0)).copy_(torch.tensor(starts))
    end = max(start + 1 for start in starts)
    return Span(inputs, positions.to(device), tuple(starts), end)


class Embedder(Embed):
    """Embeds spans of prompts: what the language model reads are embeddings."""

    @property
    def sees_ahead(self) -> bool:
        """False: attention is causal."""
        return False

    @torch.inference_mode()
    def __call__(self, pieces: Sequence[Piece], start: int, before: Sequence[Piece]) -> Span:
        """See `Embed`."""
        visuals = _visuals(pieces)
        flat: list[int] = []
        slots: list[int] = []
        for piece in pieces:
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
        # Positions are computed on the CPU, because reading them below would otherwise wait for the
        # device.
        ids = torch.tensor(flat)
        positions = self._family.positions(ids, [piece.shape for piece in visuals], start)
        embeds = self._embeddings(ids.to(self._device))
        if features is not None:
            embeds[slots] = features.to(embeds)
        starts, end = piece_starts(pieces, positions, start)
        return Span({"inputs_embeds": embeds[None]}, positions.to(self._device), starts, end)

    @torch.inference_mode()
    def words(self, tokens: Sequence[int], starts: Sequence[int]) -> Span:
        """See `Embed`."""
        ids = torch.tensor(tokens)
        embeds = self._embeddings(ids.to(self._device))
        return word_span(self._family, {"inputs_embeds": embeds[None]}, ids, starts, embeds.device)

    def join(self, spans: Sequence[Span]) -> Mapping[str, Any]:
        """See `Embed`."""
        return {"inputs_embeds": torch.cat([span.inputs["inputs_embeds"] for span in spans], dim=1)}

    def _slot_features(self, visuals: Sequence[Frame | Clip], n_slots: int) -> torch.Tensor:
        features = torch.cat(self._features.get(visuals))
        if len(features) != n_slots:
            raise ModelError(
                f"the processor makes {n_slots} image tokens of {len(visuals)} frames and the "
                f"model {len(features)} features; they do not belong to one checkpoint"
            )
        return features
