from collections.abc import Callable
from typing import Any

import pytest
import torch
from transformers import GenerationConfig

from infthor_eval.errors import ModelError
from model_adapters.hf.decoding import Generation, cut_at_stop, generate, read_generation

VOCABULARY = 10


def _points_at(token: int) -> torch.Tensor:
    return torch.nn.functional.one_hot(torch.tensor(token), VOCABULARY).float()


def _counting(token: int) -> torch.Tensor:
    return _points_at(token + 1)


def _run(settings: Generation, limit: int, finished: Callable[[list[int]], bool] = lambda ids: False) -> list[int]:
    return generate(_points_at(1), _counting, context=[0], settings=settings, max_new_tokens=limit, finished=finished)


def test_stops_before_the_end_token() -> None:
    assert _run(Generation(frozenset({4, 9})), 50) == [1, 2, 3]


def test_stops_at_the_limit() -> None:
    assert _run(Generation(frozenset({9})), 2) == [1, 2]


def test_stops_when_told() -> None:
    assert _run(Generation(frozenset({9})), 50, lambda ids: 3 in ids) == [1, 2, 3]


def test_no_token_is_fed_in_vain() -> None:
    fed: list[int] = []

    def step(token: int) -> torch.Tensor:
        fed.append(token)
        return _counting(token)

    generate(
        _points_at(1),
        step,
        context=[],
        settings=Generation(frozenset()),
        max_new_tokens=3,
        finished=lambda ids: False,
    )
    assert fed == [1, 2]


def test_the_penalty_is_for_tokens_of_context_and_reply() -> None:
    # 5 leads by a little but lies in the context; once 3 is said, it is penalised too and 4 leads.
    logits = torch.tensor([0.0, 0.0, 0.0, 2.0, 1.9, 2.1, 0.0, 0.0, 0.0, 0.0])
    replies = generate(
        logits,
        lambda token: logits,
        context=[5],
        settings=Generation(frozenset(), repetition_penalty=1.2),
        max_new_tokens=2,
        finished=lambda ids: False,
    )
    assert replies == [3, 4]


@pytest.mark.parametrize(("eos", "ends"), [(None, set()), (3, {3}), ([3, 4], {3, 4})])
def test_end_tokens_come_from_the_checkpoint(eos: Any, ends: set[int]) -> None:
    assert read_generation(GenerationConfig(eos_token_id=eos)) == Generation(frozenset(ends))


def test_sampling_settings_do_not_matter() -> None:
    config = GenerationConfig(eos_token_id=1, do_sample=True, temperature=0.1, top_k=1, repetition_penalty=1.05)
    assert read_generation(config) == Generation(frozenset({1}), 1.05)


@pytest.mark.parametrize("setting", [{"num_beams": 4}, {"no_repeat_ngram_size": 3}, {"suppress_tokens": [1]}])
def test_settings_that_would_change_replies_are_refused(setting: dict[str, Any]) -> None:
    with pytest.raises(ModelError, match=next(iter(setting))):
        read_generation(GenerationConfig(eos_token_id=1, **setting))


@pytest.mark.parametrize(
    ("text", "stop", "cut"),
    [
        ("go to the sink", ("sink", " the"), "go to"),
        ("go", ("x",), None),
        ("go", (), None),
        ("stop", ("stop",), ""),
    ],
)
def test_text_is_cut_before_the_first_stop_string(text: str, stop: tuple[str, ...], cut: str | None) -> None:
    assert cut_at_stop(text, stop) == cut
