"""One user turn that grows by actions and frames, as agents are asked: nothing in it is encoded
twice."""

from dataclasses import replace
from itertools import pairwise

import pytest
import torch
from transformers import AutoModelForImageTextToText, AutoTokenizer

from model_adapters import load

from ..asking import up_to
from ..checkpoints import FAMILIES, twin

TOKENS = ("<|act|>", "<|plan|>", "<|goal|>")
STOP = ("<|act|>",)
ACTIONS = ("MoveAhead", "RotateLeft", "PickupObject", "LookDown", "mug")
GOAL = "<|goal|>Your main goal: put a mug in the sink<|goal|>"
PLAN = "<|plan|>Plan: pick up the mug<|plan|><|act|>"
STEPS = 60
EVERY = (
    15  # steps, of which the last is also asked of a model that encodes all of them for its reply
)
# tokens that a chat template writes behind the user's words, and those at the joint of two texts
TAIL = 24
CASES = {"greedy": up_to(10, stop=STOP), "drawn": up_to(10, stop=STOP, temperature=1.0, seed=5)}


def _steps(frames, n):
    """What is appended before each of n replies."""
    yield [GOAL, frames[0], PLAN]
    for step in range(1, n):
        yield [f"{ACTIONS[step % 5]}<|act|>", frames[step % len(frames)], "<|act|>"]


def _small_vision(config):
    def smaller(ids, vocab_size):
        small_config = config(ids, vocab_size)
        small_config.vision_config.image_size = 56
        small_config.image_grid_pinpoints = [[56, 56]]
        return small_config

    return smaller


def _small(family):
    """A twin whose frames take few tokens, for many of them."""
    usual = twin(family)
    if family != "llava-onevision":
        return usual
    pinpoints = [[56, 56]]
    settings = {"size": {"height": 56, "width": 56}, "image_grid_pinpoints": pinpoints}
    return replace(usual, config=_small_vision(usual.config), image_settings=settings)


def _add_tokens(folder):
    """Add the tokens of plans as a fine-tuning does, and make the model say the one that ends an
    action often."""
    tokenizer = AutoTokenizer.from_pretrained(folder)
    model = AutoModelForImageTextToText.from_pretrained(folder)
    assert tokenizer.add_special_tokens({"additional_special_tokens": list(TOKENS)}) == len(TOKENS)
    torch.manual_seed(0)
    model.resize_token_embeddings(len(tokenizer), mean_resizing=False)
    with torch.no_grad():
        model.get_output_embeddings().weight[tokenizer.convert_tokens_to_ids("<|act|>")] *= 3
    tokenizer.save_pretrained(folder)
    model.save_pretrained(folder)


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Checkpoints of two families, with the usual tokenizer and with one that has the tokens of
    plans."""
    root = tmp_path_factory.mktemp("growing")
    by_family = {}
    for family in ("qwen2.5-vl", "llava-onevision"):
        for tokens in ("usual", "added"):
            by_family[family, tokens] = root / f"{family}-{tokens}"
            _small(family).save(by_family[family, tokens], seed=0)
        _add_tokens(by_family[family, "added"])
    return by_family


def _load(folders, family, tokens, **options):
    defaults = {
        "pretrained": str(folders[family, tokens]),
        "device": "cpu",
        "dtype": "float32",
        "max_tokens": "0",
    }
    return load(family, {**defaults, **options}, seed=0)


def _play(model, frames, n, decoding, every=1):
    """The replies after every so many of n steps, the last one among them."""
    talk, replies = model.conversation(), []
    for step, parts in enumerate(_steps(frames, n), start=1):
        talk.append(*parts)
        if step % every == 0:
            replies.append(talk.reply(decoding))
    return replies


@pytest.mark.parametrize("decoding", CASES)
@pytest.mark.parametrize("prompt", ["plain", "chat"])
@pytest.mark.parametrize("tokens", ["usual", "added"])
@pytest.mark.parametrize("family", ["qwen2.5-vl", "llava-onevision"])
def test_replies_are_those_of_a_model_that_shares_nothing(
    folders, frames, family, tokens, prompt, decoding
):
    shared, alone = (
        _play(
            _load(folders, family, tokens, prompt=prompt, share_prefix=share),
            frames,
            STEPS,
            CASES[decoding],
            every,
        )
        for share, every in (("true", 1), ("false", EVERY))
    )
    asked_both = shared[EVERY - 1 :: EVERY]
    assert [(reply.text, reply.token_ids) for reply in asked_both] == [
        (reply.text, reply.token_ids) for reply in alone
    ]
    for before, after in pairwise(shared):
        assert after.n_cached_tokens >= before.n_context_tokens - TAIL
    assert all(reply.n_cached_tokens == 0 for reply in alone)
    assert not any("<|" in reply.text for reply in shared)
    if tokens == "added":
        act = AutoTokenizer.from_pretrained(folders[family, tokens]).convert_tokens_to_ids(
            "<|act|>"
        )
        ended = [reply for reply in shared if act in reply.token_ids]
        assert len({reply.text for reply in ended}) > 1
        assert all(reply.token_ids.index(act) == len(reply.token_ids) - 1 for reply in ended)


class _Counting:
    """A family that counts the frames that are given positions: those that are encoded."""

    def __init__(self, family):
        self._family = family
        self.n_frames = 0

    def __getattr__(self, name):
        return getattr(self._family, name)

    def positions(self, ids, sizes, start):
        self.n_frames += len(sizes)
        return self._family.positions(ids, sizes, start)


@pytest.mark.parametrize("prompt", ["plain", "chat"])
@pytest.mark.parametrize("family", FAMILIES)
def test_every_frame_is_encoded_once(family, prompt, frames):
    model = load(f"{family}-tiny", {"prompt": prompt, "max_tokens": "0"}, seed=0)
    counting = _Counting(model._loaded.family)
    model._embed._family = counting
    replies = _play(model, frames, 8, CASES["greedy"])
    assert counting.n_frames == 8
    for before, after in pairwise(replies):
        assert after.n_cached_tokens >= before.n_context_tokens - TAIL
