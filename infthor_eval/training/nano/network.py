"""The small model as a network: sequences to their loss, and what its vision tower says of each part of a frame.

The tower is told what is where by the embeddings of the objects' names, in each way in which texts write them: so
words and what they look like lie in one space before the decoder has to bring them together.
"""

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits

from infthor_eval.household.wording import compact_name, noun
from infthor_eval.training.nano.architecture import TOKENS
from infthor_eval.training.nano.frame_dataset import FrameDataset
from infthor_eval.training.network import SequenceModel
from model_adapters.hf.loaded import Loaded
from model_adapters.hf.prompt import Frame

__all__ = ["NanoNetwork", "spellings"]

_AT_ONCE = 256  # frames in the tower
_SCALE, _BIAS = 8.0, -4.0  # of how alike a part of a frame and a name are, to begin with


def spellings(object_type: str) -> tuple[str, ...]:
    """An object type as questions, answers, actions and plans write it."""
    return f" {noun(object_type)}", compact_name(object_type), f" {object_type}", f" {compact_name(object_type)}"


class NanoNetwork(SequenceModel):
    """A `SequenceModel` that finds its frames in an album.

    Args:
        loaded: the model.
        album: all frames.

    Attributes:
        last_seen: places in the album and features of the last sequences' frames.
    """

    last_frames: tuple[list[int], Tensor]

    def __init__(self, loaded: Loaded, dataset: FrameDataset) -> None:
        super().__init__(loaded)
        self._album = dataset
        self._places = dataset.places()
        self._cached_features: Tensor | None = None
        self._names = [_bags(loaded.tokenizer, dataset.types, way) for way in range(len(spellings("Mug")))]
        self.scale = torch.nn.Parameter(torch.tensor(_SCALE))
        self.bias = torch.nn.Parameter(torch.full((len(dataset.types),), _BIAS))

    def features(self, frames: Sequence[Frame]) -> list[Tensor]:
        """See `SequenceModel`."""
        distinct = list(dict.fromkeys(frame.digest for frame in frames))
        places = [self._places[digest] for digest in distinct]
        self.last_frames = places, self.frame_features(places)
        by_digest = dict(zip(distinct, self.last_frames[1], strict=True))
        return [by_digest[frame.digest] for frame in frames]

    def cache_features(self) -> None:
        """See all frames; from then on sequences have their features from memory, and the tower is not trained.

        It takes four fifths of a sequence's time.
        """
        every = range(len(self._album.frames))
        with torch.no_grad():
            self._cached_features = torch.cat(
                [self.frame_features(every[at : at + _AT_ONCE]) for at in every[::_AT_ONCE]]
            )

    def frame_features(self, places: Sequence[int]) -> Tensor:
        """Features of frames of the album, (frames, tokens, hidden)."""
        if self._cached_features is not None:
            return self._cached_features[list(places)]
        grid = torch.tensor([[1, *([int(self._album.pixels.shape[1] ** 0.5)] * 2)]]).expand(len(places), 3)
        output: Any = self.model.model.visual(self._album.tower_inputs(places), grid_thw=grid)
        features: Tensor = output.pooler_output
        return features.reshape(len(places), TOKENS, -1)

    def vision_loss(self, features: Tensor, places: Sequence[int], way: int) -> Tensor:
        """How wrong the features are about what is to be seen, a scalar.

        Of each part of a frame, and of the whole; what is in the frame but too far away to count is left open there.

        Args:
            features: (frames, tokens, hidden).
            places: of the frames, in the album.
            way: of writing the names.
        """
        chosen = list(places)
        names = self._names[way] @ self.model.get_input_embeddings().weight
        logits = self.scale * (features @ names.T) + self.bias
        in_parts = binary_cross_entropy_with_logits(logits, self._album.cells[chosen], reduction="none")
        shown, present = self._album.shown[chosen], self._album.present[chosen]
        in_whole = binary_cross_entropy_with_logits(torch.logsumexp(logits, 1), shown, reduction="none")
        return in_parts.sum(-1).mean() + (in_whole * (1 - present + shown).clamp(max=1)).sum(-1).mean()

    @property
    def n_spellings(self) -> int:
        """In how many ways names are written."""
        return len(self._names)


def _bags(tokenizer: Any, types: Sequence[str], way: int) -> Tensor:
    """The mean of a name's tokens, as a matrix (types, vocabulary)."""
    bags = torch.zeros(len(types), len(tokenizer))
    for row, object_type in enumerate(types):
        ids = tokenizer(spellings(object_type)[way], add_special_tokens=False)["input_ids"]
        for token in ids:
            bags[row, token] += 1 / len(ids)
    return bags
