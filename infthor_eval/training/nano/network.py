"""The small model, with two losses: of sequences, and of what each part of a frame shows.

The vision loss compares the tower's features with the embeddings of the objects' names, in all
spellings that occur in texts. So words and images share one space before the decoder is trained.
What is held, what is open, and what is in which receptacle is read off the features by linear
layers, which are not part of the model.
"""

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits

from infthor_eval.household.wording import compact_name, noun
from infthor_eval.training.encoding import TrainingSequence
from infthor_eval.training.nano.frame_dataset import FrameDataset
from infthor_eval.training.nano.tower import tower_features
from infthor_eval.training.network import SequenceModel
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.prompting.prompt import Frame

__all__ = ["NanoNetwork", "spellings"]

_BATCH = 256  # frames in the tower at once
# initial scale and bias of similarities, which are trained
_SCALE = 8.0
_BIAS = -4.0
_STATE_WEIGHT = 2.0  # of the losses of what is held, open and in a receptacle: they are rare


def spellings(object_type: str) -> tuple[str, ...]:
    """Return the spellings of an object type in questions, answers, actions and plans."""
    return (
        f" {noun(object_type)}",
        compact_name(object_type),
        f" {object_type}",
        f" {compact_name(object_type)}",
    )


class NanoNetwork(SequenceModel):
    """A `SequenceModel` that takes its frames from a dataset.

    Args:
        loaded: the model.
        dataset: all frames.

    Attributes:
        scale: scale of the similarities of features and names.
        bias: bias of these, one for each type.
        states: layers that read off the features what is held, open and in which receptacle.
    """

    def __init__(self, loaded: LoadedCheckpoint, dataset: FrameDataset) -> None:
        super().__init__(loaded)
        self._dataset = dataset
        self._index_by_digest = dataset.index_by_digest()
        self._cached_features: Tensor | None = None
        self._names = [
            _token_means(loaded.tokenizer, dataset.types, at) for at in range(len(spellings("Mug")))
        ]
        self.scale = torch.nn.Parameter(torch.tensor(_SCALE))
        self.bias = torch.nn.Parameter(torch.full((len(dataset.types),), _BIAS))
        cells = dataset.cells
        self.states = torch.nn.ModuleList(
            _state_layer(loaded.model.config.text_config.hidden_size, labels.shape[-1])
            for labels in (cells.held, cells.opened, cells.related)
        )

    def features(self, frames: Sequence[Frame]) -> list[Tensor]:
        """Return features of each frame; see `SequenceModel`."""
        indices = self._indices(frames)
        rows = dict(zip(indices, self.frame_features(indices), strict=True))
        return [rows[self._index_by_digest[frame.digest]] for frame in frames]

    def frames_of(self, sequences: Sequence[TrainingSequence]) -> tuple[list[int], Tensor]:
        """Return indices in the dataset and features of the sequences' frames, each frame once."""
        indices = self._indices([frame for sequence in sequences for frame in sequence.frames])
        return indices, self.frame_features(indices)

    def _indices(self, frames: Sequence[Frame]) -> list[int]:
        indices = [self._index_by_digest[frame.digest] for frame in frames]
        return list(dict.fromkeys(indices))

    def cache_features(self) -> None:
        """Compute the features of all frames once, for all later sequences; the tower is not
        trained any more.

        The tower takes most of a step's time.
        """
        indices = range(len(self._dataset))
        with torch.no_grad():
            batches = [self.frame_features(indices[at : at + _BATCH]) for at in indices[::_BATCH]]
        self._cached_features = torch.cat(batches)

    def frame_features(self, indices: Sequence[int]) -> Tensor:
        """Return the features of frames of the dataset, (frames, tokens, hidden)."""
        if self._cached_features is not None:
            return self._cached_features[list(indices)]
        pixels = self._dataset.pixels[list(indices)].float()
        return tower_features(self.model.model.visual, pixels)

    def naming_loss(self, features: Tensor, indices: Sequence[int], spelling: int) -> Tensor:
        """Return the loss of naming objects by the features, a scalar.

        It is the sum of a loss for the types in each part of a frame and one for the types that the
        whole frame shows. The latter ignores types that are present but too far away to count as
        shown.

        Args:
            features: features of frames, (frames, tokens, hidden).
            indices: indices of these frames in the dataset.
            spelling: index of the spelling of names.
        """
        rows = list(indices)
        names = self._names[spelling] @ self.model.get_input_embeddings().weight
        logits = self.scale * (features @ names.T) + self.bias
        shown = self._dataset.shown[rows].float()
        is_clear = (shown > 0) | ~self._dataset.present[rows]
        frame_loss = binary_cross_entropy_with_logits(
            torch.logsumexp(logits, 1), shown, reduction="none"
        )
        cell_loss = _cell_loss(logits, self._dataset.cells.types[rows])
        return cell_loss + (frame_loss * is_clear).sum(-1).mean()

    def state_loss(self, features: Tensor, indices: Sequence[int]) -> Tensor:
        """Return the loss of what is held, open and in which receptacle by the features, a scalar.

        Args:
            features: features of frames, (frames, tokens, hidden).
            indices: indices of these frames in the dataset.
        """
        cells = self._dataset.cells
        losses = [
            _cell_loss(layer(features), labels[list(indices)])
            for layer, labels in zip(
                self.states, (cells.held, cells.opened, cells.related), strict=True
            )
        ]
        return _STATE_WEIGHT * torch.stack(losses).sum()

    @property
    def n_spellings(self) -> int:
        """Number of spellings of a name."""
        return len(self._names)


def _state_layer(hidden: int, n_labels: int) -> torch.nn.Linear:
    layer = torch.nn.Linear(hidden, n_labels)
    torch.nn.init.constant_(layer.bias, _BIAS)
    return layer


def _cell_loss(logits: Tensor, labels: Tensor) -> Tensor:
    """Return the loss of the labels of a cell, summed over its labels, averaged over cells."""
    losses = binary_cross_entropy_with_logits(logits, labels.float(), reduction="none")
    return losses.sum(-1).mean()


def _token_means(tokenizer: Any, types: Sequence[str], spelling: int) -> Tensor:
    """Return a matrix, (types, vocabulary), that averages the embeddings of a name's tokens."""
    means = torch.zeros(len(types), len(tokenizer))
    for row, object_type in enumerate(types):
        ids = tokenizer(spellings(object_type)[spelling], add_special_tokens=False)["input_ids"]
        for token in ids:
            means[row, token] += 1 / len(ids)
    return means
