"""Tokens of actions from scores that are known."""

import pytest
import torch

from infthor_eval.errors import ModelError
from model_adapters.policies.decoding import decode_greedily

LEGAL = [range(4, 6), range(6, 8)]


def _scores(best, second=0):
    scores = torch.zeros(10)
    scores[best], scores[second] = 9.0, 5.0
    return scores


def test_only_legal_tokens_are_chosen_at_each_place():
    fed = []

    def step(token):
        fed.append(token)
        return _scores(best=0, second=7)

    assert decode_greedily(_scores(best=9, second=5), step, LEGAL, constrained=True) == [5, 7]
    assert fed == [5]


def test_without_the_constraint_others_are_clipped_as_the_originals_do():
    fed = []

    def step(token):
        fed.append(token)
        return _scores(best=0)

    assert decode_greedily(_scores(best=9), step, LEGAL, constrained=False) == [5, 6]
    assert fed == [9]  # what was written is what the model reads; only what it means is clipped
    assert decode_greedily(
        _scores(best=4), lambda token: _scores(best=7), LEGAL, constrained=False
    ) == [4, 7]


@pytest.mark.parametrize("bad", [torch.nan, torch.inf])
@pytest.mark.parametrize("place", [1, 2])
def test_scores_that_are_no_numbers_are_refused(bad, place):
    broken = torch.full((10,), bad)
    first, second = (broken, _scores(6)) if place == 1 else (_scores(4), broken)
    with pytest.raises(ModelError, match=f"action token {place} has no finite score"):
        decode_greedily(first, lambda token: second, LEGAL, constrained=True)
