"""What methods keep, against what loops over tokens keep."""

from dataclasses import dataclass, field

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from model_adapters.hf.kept import methods

HEADS, SIZE = 2, 4


@dataclass
class View:
    """States of one layer."""

    n_tokens: int
    budget: int
    chosen: tuple[int, ...] | None = None
    frames: torch.Tensor = field(init=False)

    def __post_init__(self):
        draw = torch.Generator().manual_seed(self.n_tokens)
        self.states = torch.randn(3, HEADS, self.n_tokens, SIZE, generator=draw)
        self.frames = torch.arange(self.n_tokens) // 3

    @property
    def n_frames(self):
        return self.n_tokens // 3

    def keys(self, _layer):
        return self.states[0]

    def values(self, _layer):
        return self.states[1]

    def asked(self, _layer):
        return self.states[2].abs().sum(-1)


views = st.integers(1, 30).flatmap(
    lambda n: st.builds(View, st.just(n), st.integers(0, n).map(lambda budget: max(1, budget)))
)


def _best(scores, n):
    return sorted(sorted(range(len(scores)), key=lambda at: (-scores[at], at))[:n])


@settings(deadline=None)
@given(view=views)
def test_the_keys_of_the_smallest_norms_are_kept(view):
    places = methods.Norm().keep(view, 0)
    for head in range(HEADS):
        norms = [-float(sum(x * x for x in key) ** 0.5) for key in view.states[0, head]]
        assert places[head].tolist() == _best(norms, view.budget)


@settings(deadline=None)
@given(view=views)
def test_what_the_question_attends_to_is_kept(view):
    places = methods.Question().keep(view, 0)
    for head in range(HEADS):
        scores = view.asked(0)[head].tolist()
        padded = [0.0, 0.0, *scores, 0.0, 0.0]
        pooled = [round(sum(padded[at : at + 5]) / 5, 5) for at in range(len(scores))]
        kept = [pooled[at] for at in places[head].tolist()]
        assert sorted(kept) == sorted(pooled[at] for at in _best(pooled, view.budget))
    assert methods.Question.asks


@settings(deadline=None)
@given(view=views)
def test_first_and_last_tokens_are_kept(view):
    n_first = min(4, view.budget)
    last = view.n_tokens - (view.budget - n_first)
    expected = [at for at in range(view.n_tokens) if at < n_first or at >= last]
    assert methods.Sinks().keep(view, 0).tolist() == expected


@settings(deadline=None)
@given(view=views)
def test_others_are_averaged_into_what_is_most_like_them(view):
    method = methods.Merge()
    places = method.keep(view, 0).tolist()
    assert len(places) == view.budget
    merged = method.states(view, 0, torch.tensor(places))
    for head in range(HEADS):
        keys = view.states[0, head]
        groups = {place: [place] for place in places}
        for at in set(range(view.n_tokens)) - set(places):
            alike = [float(torch.cosine_similarity(keys[at], keys[it], dim=0)) for it in places]
            groups[places[max(range(len(places)), key=alike.__getitem__)]].append(at)
        for states, ours in zip(view.states[:2, head], merged, strict=True):
            expected = torch.stack([states[groups[place]].mean(0) for place in places])
            torch.testing.assert_close(ours[head], expected)


def test_chosen_frames_are_kept_whole():
    view = View(12, 6, chosen=(0, 2))
    assert methods.Frames().keep(view, 0).tolist() == [0, 1, 2, 6, 7, 8]
    assert methods.Frames().keep(View(12, 6, chosen=()), 0).tolist() == []


def test_eight_bits_are_near():
    view = View(20, 20)
    method = methods.EightBits()
    keys, values = method.states(view, 0, method.keep(view, 0))
    for ours, whole in ((keys, view.states[0]), (values, view.states[1])):
        assert not torch.equal(ours, whole)
        largest = whole.abs().amax(-1, keepdim=True)
        assert ((ours - whole).abs() <= largest / 254 * 1.001).all()
        assert (ours / (largest / 127)).round().unique().numel() <= 255


@pytest.mark.parametrize("name", ["Norm", "Question", "Sinks", "Merge"])
def test_with_room_for_all_nothing_changes(name):
    view = View(15, 15)
    method = getattr(methods, name)()
    keys, values = method.states(view, 0, method.keep(view, 0))
    torch.testing.assert_close(keys, view.states[0])
    torch.testing.assert_close(values, view.states[1])
