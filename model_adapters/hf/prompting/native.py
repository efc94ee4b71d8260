"""Spans of a prompt as inputs of a model that merges frames into them by itself.

transformers' models take what their vision encoder made of images (`mm_encoder_outputs`), and do
all that follows: projection, features that enter at several layers, embeddings of each layer, masks
in both directions over an image. So none of it is written here again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Protocol

import torch

from model_adapters.hf.family import Family, Pixels
from model_adapters.hf.prompting.embedding import Embed, Span, piece_starts, word_span
from model_adapters.hf.prompting.prompt import Frame, Piece, token_ids

# Outputs of vision encoders that are not for the language model, if `pooler_output` is there.
_INNER = ("last_hidden_state", "hidden_states", "attentions")
_ENCODED = "mm_encoder_outputs"  # the model's input
_BY_LAYER = ("deepstack_features",)  # one entry for each layer, not for each image


@dataclass(frozen=True)
class EncodedImage:
    """What a model's vision encoder makes of one image.

    Attributes:
        output: the encoder's output, of transformers' own class.
    """

    output: Any

    @property
    def nbytes(self) -> int:
        """Bytes of its tensors."""
        return sum(tensor.nbytes for tensor in _tensors(list(self.output.values())))

    def clone(self) -> "EncodedImage":
        """Return itself: it is encoded alone, so its tensors are no views of a batch's."""
        return self

    @classmethod
    def of(cls, output: Any) -> "EncodedImage":
        """Keep of an encoder's output what the language model takes."""
        if output.get("pooler_output") is not None:
            for name in _INNER:
                if output.get(name) is not None:
                    output[name] = None
        return cls(output)

    @staticmethod
    def join(images: Sequence["EncodedImage"]) -> Any:
        """Return the outputs for several images as the encoder would return them together."""
        outputs = [image.output for image in images]
        joined = {
            field.name: _join(
                [output[field.name] for output in outputs], by_layer=field.name in _BY_LAYER
            )
            for field in fields(outputs[0])
            if outputs[0].get(field.name) is not None
        }
        return type(outputs[0])(**joined)


def _join(values: Sequence[Any], *, by_layer: bool = False) -> Any:
    first = values[0]
    if isinstance(first, torch.Tensor):
        return torch.cat(list(values))
    if by_layer:
        return [_join(layer) for layer in zip(*values, strict=True)]
    return [one for value in values for one in value]


def _tensors(value: Any) -> list[torch.Tensor]:
    if isinstance(value, torch.Tensor):
        return [value]
    parts = value if isinstance(value, list | tuple) else []
    return [tensor for part in parts for tensor in _tensors(part)]


class MergingFamily(Family, Protocol):
    """A family whose model merges frames into the prompt by itself."""

    @property
    def mask_types(self) -> Mapping[str, Mapping[int, int]]:
        """Inputs of the model that say which tokens attend to each other in both directions, by
        name: types by token id, 0 for all others."""

    @property
    def token_types(self) -> Mapping[str, Mapping[int, int]]:
        """Other inputs of the model of one value for each token, likewise."""

    def encode(self, frames: Sequence[Pixels]) -> list[EncodedImage]:
        """Return what the vision encoder makes of each prepared frame."""


class NativeEmbedder(Embed):
    """Prepares spans of prompts as the model's own inputs."""

    _family: MergingFamily

    @property
    def sees_ahead(self) -> bool:
        """See `Embed`: true if the family's masks have types of tokens."""
        return bool(self._family.mask_types)

    @torch.inference_mode()
    def __call__(self, pieces: Sequence[Piece], start: int, before: Sequence[Piece]) -> Span:
        """See `Embed`."""
        frames = [piece for piece in pieces if isinstance(piece, Frame)]
        ids = torch.tensor([*token_ids(pieces)])
        positions = self._family.positions(ids, [frame.shape for frame in frames], start)
        starts, end = piece_starts(pieces, positions, start)
        inputs: dict[str, Any] = {"input_ids": ids[None].to(self._device)}
        if frames:
            inputs[_ENCODED] = {"image": EncodedImage.join(self._features.get(frames))}
            # Masks are made of the whole sequence.
            inputs |= self._types(self._family.mask_types, [*before, *pieces])
        inputs |= self._types(self._family.token_types, pieces)
        return Span(inputs, positions.to(self._device), starts, end)

    @torch.inference_mode()
    def words(self, tokens: Sequence[int], starts: Sequence[int]) -> Span:
        """See `Embed`."""
        ids = torch.tensor(tokens)
        inputs = {"input_ids": ids[None].to(self._device)}
        return word_span(self._family, inputs, ids, starts, self._device)

    def join(self, spans: Sequence[Span]) -> Mapping[str, Any]:
        """See `Embed`; no span sees ahead."""
        inputs: dict[str, Any] = {
            name: torch.cat([span.inputs[name] for span in spans], dim=-1)
            for name in ("input_ids", *self._family.token_types)
        }
        encoded = [
            EncodedImage(span.inputs[_ENCODED]["image"])
            for span in spans
            if _ENCODED in span.inputs
        ]
        if encoded:
            inputs[_ENCODED] = {"image": EncodedImage.join(encoded)}
        return inputs

    def _types(
        self, inputs: Mapping[str, Mapping[int, int]], pieces: Sequence[Piece]
    ) -> dict[str, torch.Tensor]:
        """Return inputs of one value for each token, (1, tokens)."""
        ids = [*token_ids(pieces)] if inputs else []
        return {
            name: torch.tensor([[types.get(token, 0) for token in ids]], device=self._device)
            for name, types in inputs.items()
        }
