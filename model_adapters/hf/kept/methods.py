"""What is kept of a cache, by method.

Positions of kept tokens stay those that they had. To add a method: a class here with `keep`, and a
memory of it (`infthor_eval/memory/caches.py`); one of another package is named MODULE:CLASS.
"""

from typing import ClassVar

import torch
from torch import Tensor
from torch.nn.functional import avg_pool1d, normalize

from model_adapters.hf.kept.view import CacheView

_SINKS = 4  # first tokens that StreamingLLM keeps
_POOLED = 5  # neighbours whose scores are averaged, as in SnapKV
_LEVELS = 127  # of 8 bits, on either side of 0


class CacheMethod:
    """Base of methods: what `keep` returns is kept as it is.

    Attributes:
        asks: True if it goes by the question, for which everything was kept until then.
        keeps_all: True if no budget holds for it.
    """

    asks: ClassVar[bool] = False
    keeps_all: ClassVar[bool] = False

    def n_bytes(self, keys: Tensor, values: Tensor) -> int:
        """Return the bytes that these take where they are stored."""
        return keys.nbytes + values.nbytes

    def keep(self, view: CacheView, layer: int) -> Tensor:
        """Return the places that are kept of a layer, ascending: (kept,), or (key heads, kept)."""
        raise NotImplementedError

    def states(self, view: CacheView, layer: int, places: Tensor) -> tuple[Tensor, Tensor]:
        """Return keys and values of what is kept, each (key heads, kept, head size)."""
        return gathered(view.keys(layer), places), gathered(view.values(layer), places)


class Frames(CacheMethod):
    """The tokens of chosen frames, and the mark that begins the last one."""

    def keep(self, view: CacheView, layer: int) -> Tensor:
        """See `CacheMethod`."""
        chosen = torch.tensor([*(view.chosen or ()), view.n_frames], device=view.frames.device)
        return torch.isin(view.frames, chosen).nonzero()[:, 0]


class Sinks(CacheMethod):
    """The first four tokens and the last ones (StreamingLLM, arXiv:2309.17453)."""

    def keep(self, view: CacheView, layer: int) -> Tensor:
        """See `CacheMethod`."""
        places = torch.arange(view.n_tokens, device=view.frames.device)
        n_first = min(_SINKS, view.budget)
        return places[(places < n_first) | (places >= view.n_tokens - (view.budget - n_first))]


class Norm(CacheMethod):
    """The tokens whose keys have the smallest norms, by head (arXiv:2406.11430)."""

    def keep(self, view: CacheView, layer: int) -> Tensor:
        """See `CacheMethod`."""
        return largest(-view.keys(layer).float().norm(dim=-1), view.budget)


class Question(CacheMethod):
    """The tokens that the question attends to, by head, averaged over neighbours (SnapKV,
    arXiv:2404.14469, whose window is the question here)."""

    asks = True

    def keep(self, view: CacheView, layer: int) -> Tensor:
        """See `CacheMethod`."""
        weights = view.asked(layer)[:, None]
        pooled = avg_pool1d(weights, _POOLED, stride=1, padding=_POOLED // 2)[:, 0]
        return largest(pooled, view.budget)


class Merge(CacheMethod):
    """Tokens at even distances, each the mean of itself and of those whose keys are most like its
    own, by head (as D2O merges, arXiv:2406.13035, with equal weights)."""

    def keep(self, view: CacheView, layer: int) -> Tensor:
        """See `CacheMethod`."""
        n_kept = min(view.budget, view.n_tokens)
        even = torch.linspace(0, view.n_tokens - 1, n_kept, device=view.frames.device)
        return even.round().long()

    def states(self, view: CacheView, layer: int, places: Tensor) -> tuple[Tensor, Tensor]:
        """See `CacheMethod`."""
        keys, values = view.keys(layer), view.values(layer)
        if not len(places):  # a budget of nothing
            return super().states(view, layer, places)
        unit = normalize(keys.float(), dim=-1)
        nearest = (unit @ unit[:, places].transpose(-1, -2)).argmax(dim=-1)  # (heads, tokens)
        nearest[:, places] = torch.arange(len(places), device=places.device)
        return _means(keys, nearest, len(places)), _means(values, nearest, len(places))


class EightBits(CacheMethod):
    """Everything, rounded to 8 bits by token and head."""

    keeps_all = True

    def keep(self, view: CacheView, layer: int) -> Tensor:
        """See `CacheMethod`."""
        return torch.arange(view.n_tokens, device=view.frames.device)

    def states(self, view: CacheView, layer: int, places: Tensor) -> tuple[Tensor, Tensor]:
        """See `CacheMethod`."""
        keys, values = super().states(view, layer, places)
        return _rounded(keys), _rounded(values)

    def n_bytes(self, keys: Tensor, values: Tensor) -> int:
        """A byte for each number, and a scale for each token and head."""
        return sum(it.numel() + it[..., 0].numel() * it.element_size() for it in (keys, values))


def gathered(states: Tensor, places: Tensor) -> Tensor:
    """Return the states of some places, of all heads or by head."""
    if places.dim() == 1:
        return states[:, places]
    return states.gather(1, places[..., None].expand(-1, -1, states.shape[-1]))


def largest(scores: Tensor, n: int) -> Tensor:
    """Return the places of the n largest scores of each head, ascending."""
    order = scores.argsort(dim=-1, descending=True, stable=True)[:, :n]
    return order.sort(dim=-1).values


def _means(states: Tensor, groups: Tensor, n_groups: int) -> Tensor:
    """Return the mean of each group of tokens, by head; groups are (heads, tokens)."""
    sums = states.new_zeros(len(states), n_groups, states.shape[-1], dtype=torch.float32)
    spread = groups[..., None].expand(-1, -1, states.shape[-1])
    sums.scatter_add_(1, spread, states.float())
    counts = torch.zeros(len(states), n_groups, device=states.device)
    counts.scatter_add_(1, groups, torch.ones_like(groups, dtype=torch.float32))
    return (sums / counts[..., None]).to(states)


def _rounded(states: Tensor) -> Tensor:
    scale = states.float().abs().amax(dim=-1, keepdim=True).clamp(min=1e-12) / _LEVELS
    return ((states.float() / scale).round() * scale).to(states)
