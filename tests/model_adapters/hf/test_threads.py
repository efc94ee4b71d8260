"""Tiny and small models compute on one torch thread; other models and the process keep theirs."""

import pytest
import torch

from infthor_eval.errors import UsageError
from model_adapters import load, options_of
from model_adapters.hf.global_settings import torch_threads

from ..asking import up_to


@pytest.fixture(autouse=True)
def two_threads():
    """A process with two torch threads."""
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    yield
    torch.set_num_threads(before)


def _threads_of(network, use):
    counts = set()
    hooks = [
        part.register_forward_pre_hook(lambda *_: counts.add(torch.get_num_threads()))
        for part in network.modules()
    ]
    use()
    for hook in hooks:
        hook.remove()
    return counts


@pytest.mark.parametrize(
    ("name", "model_options", "expected"),
    [
        ("qwen2.5-vl-tiny", {}, 1),
        ("qwen2.5-vl-tiny", {"threads": "2"}, 2),
        ("qwen2.5-vl-tiny", {"threads": "none"}, 2),
        ("qwen2.5-vl-nano", {}, 1),
        ("llava-onevision-tiny", {}, 1),
    ],
)
def test_a_model_computes_on_its_threads(name, model_options, expected, frames):
    model = load(name, model_options, seed=0)

    def use():
        parts = (frames[0], "\nWhat is it?")
        talk = model.conversation()
        talk.append(*parts)
        assert talk.n_tokens
        talk.reply(up_to(2))
        model.tokens_per_frame(frames[1])

    assert _threads_of(model.loaded.model, use) == {expected}
    assert torch.get_num_threads() == 2


@pytest.mark.parametrize(
    ("name", "model_options", "expected"),
    [("openvla-tiny", {}, 1), ("spatialvla-tiny", {"threads": "2"}, 2)],
)
def test_a_policy_acts_on_its_threads(name, model_options, expected, frames):
    policy = load(name, model_options, seed=0)
    threads = _threads_of(policy._network.weights, lambda: policy.act(frames[0], "pick up the mug"))
    assert threads == {expected}
    assert torch.get_num_threads() == 2


def test_replies_do_not_depend_on_the_number_of_threads(frames):
    replies = []
    for threads in ("1", "2"):
        model = load("qwen2.5-vl-nano", {"threads": threads}, seed=0)
        talk = model.conversation()
        talk.append(*frames, "\nHave you seen a mug?")
        replies.append(talk.reply(up_to(8)))
    assert replies[0] == replies[1]


def test_other_models_take_the_threads_of_the_process_unless_they_are_given_some():
    assert options_of("qwen2.5-vl")["threads"].default is None
    assert options_of("qwen2.5-vl-tiny")["threads"].default == 1
    with torch_threads(None):
        assert torch.get_num_threads() == 2
    with pytest.raises(ZeroDivisionError), torch_threads(1):
        assert torch.get_num_threads() == 1
        raise ZeroDivisionError
    assert torch.get_num_threads() == 2
    with pytest.raises(UsageError, match="threads=0: give a whole number from 1, at most 1,024"):
        load("qwen2.5-vl-tiny", {"threads": "0"}, seed=0)
