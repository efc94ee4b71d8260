import pytest
import torch
from transformers import GenerationConfig, TemperatureLogitsWarper, TopPLogitsWarper

from infthor_eval.errors import ModelError
from model_adapters.hf.cached.decoding import (
    Choices,
    Generation,
    ReplyState,
    decode_replies,
    read_generation,
)
from model_adapters.thinking import cut_at_stop

from ...asking import up_to

VOCABULARY = 10
END = Generation(frozenset({9}))


def _points_at(token):
    return torch.nn.functional.one_hot(torch.tensor(token), VOCABULARY).float()


def _counting(token):
    return _points_at(token + 1)


def _writing(decoding, generation=END, *, context=(0,), choices=(), finished=lambda ids: False):
    held = Choices({ids: str(ids) for ids in choices}) if choices else None
    return ReplyState(generation, decoding, context=context, choices=held, finished=finished)


def _written(reply, logits, step=_counting):
    decode_replies(logits[None], lambda tokens: torch.stack([*map(step, tokens.values())]), [reply])
    return reply.ids


def _run(generation, limit, finished=lambda ids: False):
    return _written(_writing(up_to(limit), generation, finished=finished), _points_at(1))


def test_a_reply_stops_before_the_end_token_at_the_limit_and_when_told():
    assert _run(Generation(frozenset({4, 9})), 50) == [1, 2, 3]
    assert _run(END, 2) == [1, 2]
    assert _run(END, 50, lambda ids: 3 in ids) == [1, 2, 3]


def test_no_token_is_fed_in_vain():
    fed = []

    def step(token):
        fed.append(token)
        return _counting(token)

    _written(_writing(up_to(3), Generation(frozenset())), _points_at(1), step)
    assert fed == [1, 2]


def test_replies_are_written_in_step_each_to_its_own_end():
    replies = [
        _writing(up_to(50)),
        _writing(up_to(2)),
        _writing(up_to(50), Generation(frozenset({3}))),
    ]
    fed = []

    def step(tokens):
        fed.append(dict(tokens))
        return torch.stack([_counting(token) for token in tokens.values()])

    decode_replies(torch.stack([_points_at(6), _points_at(1), _points_at(1)]), step, replies)
    assert [reply.ids for reply in replies] == [[6, 7, 8], [1, 2], [1, 2]]
    assert fed == [{0: 6, 1: 1, 2: 1}, {0: 7, 2: 2}, {0: 8}]


def test_the_penalty_is_for_tokens_of_context_and_reply_and_a_request_may_have_its_own():
    # 5 leads by a little but lies in the context; once 3 is said, it is penalised too and 4 leads.
    logits = torch.tensor([0.0, 0.0, 0.0, 2.0, 1.9, 2.1, 0.0, 0.0, 0.0, 0.0])
    for of_checkpoint, of_request, written in (
        (1.2, 1.0, [5, 5]),
        (1.0, 1.2, [3, 4]),
        (1.2, None, [3, 4]),
    ):
        generation = Generation(frozenset(), repetition_penalty=of_checkpoint)
        reply = _writing(up_to(2, repetition_penalty=of_request), generation, context=[5])
        assert _written(reply, logits, lambda token: logits) == written


UNEVEN = torch.linspace(0, 3, VOCABULARY)


def _drawn(**settings):
    return _written(
        _writing(up_to(40, **settings), Generation(frozenset())), UNEVEN, lambda token: UNEVEN
    )


def test_draws_hang_on_the_seed_alone():
    torch.manual_seed(5)
    one = _drawn(temperature=1.0, seed=1)
    torch.manual_seed(6)
    assert _drawn(temperature=1.0, seed=1) == one
    assert _drawn(temperature=1.0, seed=2) != one
    assert len(set(one)) > 3


def test_draws_leave_torchs_own_alone():
    torch.manual_seed(5)
    expected = torch.rand(1)
    torch.manual_seed(5)
    _drawn(temperature=1.0)
    assert torch.equal(torch.rand(1), expected)


def test_draws_are_those_of_transformers_warpers():
    draws = torch.Generator().manual_seed(3)
    scores = TopPLogitsWarper(0.7)(None, TemperatureLogitsWarper(1.5)(None, UNEVEN[None]))
    expected = [
        int(torch.multinomial(scores[0].softmax(-1), 1, generator=draws)) for _ in range(40)
    ]
    assert _drawn(temperature=1.5, top_p=0.7, seed=3) == expected


@pytest.mark.parametrize("settings", [{"temperature": 1e-4}, {"temperature": 5.0, "top_p": 1e-4}])
def test_hardly_any_temperature_or_nucleus_is_greedy(settings):
    assert set(_drawn(**settings)) == {VOCABULARY - 1}


@pytest.mark.parametrize(
    ("choices", "expected"),
    [
        ([(5, 6), (7, 2)], [7, 2]),  # the likelier first token decides
        ([(3,), (1, 1, 1)], [3]),
        ([(8,), (8, 1)], [8]),  # one begins like the other: the end token is likelier than 1
        ([(4, 4)], [4, 4]),
    ],
)
def test_a_reply_is_held_to_its_choices(choices, expected):
    reply = _writing(up_to(5), choices=choices)
    assert _written(reply, UNEVEN, lambda token: UNEVEN) == expected
    assert reply.choice == str(tuple(expected))


def test_the_longer_choice_is_given_where_the_model_does_not_want_to_end():
    reply = _writing(up_to(5), Generation(frozenset({0})), choices=[(8,), (8, 1), (8, 2, 5)])
    assert _written(reply, UNEVEN, lambda token: UNEVEN) == [8, 2, 5]


def test_drawn_choices_are_all_given_at_some_time():
    choices = [(1,), (1, 2), (6, 6)]
    sampled = set()
    for seed in range(40):
        reply = _writing(up_to(3, temperature=3.0, seed=seed), choices=choices)
        sampled.add(tuple(_written(reply, UNEVEN, lambda token: UNEVEN)))
    assert sampled == set(choices)


@pytest.mark.parametrize(("eos", "ends"), [(None, set()), (3, {3}), ([3, 4], {3, 4})])
def test_end_tokens_come_from_the_checkpoint(eos, ends):
    assert read_generation(GenerationConfig(eos_token_id=eos)) == Generation(frozenset(ends))


def test_sampling_settings_do_not_matter():
    config = GenerationConfig(
        eos_token_id=1, do_sample=True, temperature=0.1, top_k=1, repetition_penalty=1.05
    )
    assert read_generation(config) == Generation(frozenset({1}), 1.05)


@pytest.mark.parametrize(
    "setting", [{"num_beams": 4}, {"no_repeat_ngram_size": 3}, {"suppress_tokens": [1]}]
)
def test_settings_that_would_change_replies_are_refused(setting):
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
def test_text_is_cut_before_the_first_stop_string(text, stop, cut):
    assert cut_at_stop(text, stop) == cut
