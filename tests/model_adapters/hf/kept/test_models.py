"""Models that answer behind a cut cache."""

import pytest
import torch

from infthor_eval.errors import ModelError
from model_adapters import CacheCut, load
from model_adapters.hf.kept.cutting import split_at_last_frame
from model_adapters.hf.kept.methods import CacheMethod
from model_adapters.hf.kept.view import owners_of

from ....helpers.refusals import read_one_line
from ...asking import load_saved, talk_of, up_to, user

METHODS = "model_adapters.hf.kept.methods"
QUESTIONS = [["\nWhat is it?"], ["\nWhere is the mug then?"], ["\nHow many?"]]
ALL = ("Frames", "Sinks", "Norm", "Question", "Merge")


class TooMany(CacheMethod):
    """Keeps more than it may."""

    def keep(self, view, layer):
        return torch.arange(view.n_tokens)


@pytest.fixture(scope="module")
def model(checkpoints):
    return load_saved("qwen2.5-vl", checkpoints["qwen2.5-vl"], chunk_tokens=40)


def _cut(method, **settings):
    return CacheCut(method=f"{METHODS}:{method}", **settings)


def _replies(model, frames, cut=None, questions=QUESTIONS, new=8):
    talk = talk_of(model, user(*frames))
    return talk.replies(questions, up_to(new, cache=cut))


def _ids(replies):
    return [reply.token_ids for reply in replies]


@pytest.mark.parametrize("family", ["qwen2.5-vl", "llava-onevision", "pixtral"])
@pytest.mark.parametrize("method", ALL)
def test_a_budget_of_everything_replies_as_the_whole_cache(family, method, checkpoints, frames):
    model = load_saved(family, checkpoints[family], chunk_tokens=400)
    chosen = tuple(range(len(frames) - 1)) if method == "Frames" else None
    dense = _replies(model, frames)
    cut = _replies(model, frames, _cut(method, frames=chosen, clues=(1, 2)))
    assert _ids(cut) == _ids(dense)
    assert all(reply.kept.clues == 1.0 for reply in cut)
    assert all(reply.kept is None for reply in dense)


@pytest.mark.parametrize("method", ALL)
def test_replies_alone_and_together_and_after_others_are_the_same(method, model, frames):
    chosen = (0, 3) if method == "Frames" else None
    cut = _cut(method, frames=chosen, budget=20, clues=(3,))
    model.forget()
    first = _replies(model, frames, cut)
    assert _ids(first) != _ids(_replies(model, frames))
    alone = [_replies(model, frames, cut, [question])[0] for question in QUESTIONS]
    assert _ids(alone) == _ids(first)
    assert [reply.kept for reply in alone] == [reply.kept for reply in first]
    _replies(model, list(reversed(frames)), cut)
    _replies(model, frames[:3], cut)
    assert _ids(_replies(model, frames, cut)) == _ids(first)


def test_one_encoding_serves_all_cuts(model, frames):
    model.forget()
    counts = [
        [reply.n_cached_tokens for reply in _replies(model, frames, _cut(method, budget=20))]
        for method in ("Sinks", "Norm", "Question", "Merge")
    ]
    n_before = counts[0][1]
    assert counts[0] == [0, n_before, n_before]
    assert counts[1:] == [[n_before] * 3] * 3
    # Beginnings of it, too; what follows is encoded behind them.
    assert _replies(model, frames[:4], _cut("Norm", budget=9))[0].n_cached_tokens > 0


def test_what_is_kept_is_counted(model, frames):
    n_frame = model.tokens_per_frame(frames[0])
    (reply, *_) = _replies(model, frames, _cut("Frames", frames=(1, 4), clues=(1, 2)))
    assert reply.kept.clues == 0.5
    assert reply.kept.tokens >= 2 * n_frame
    layers = model.loaded.model.get_decoder().config.num_hidden_layers
    (small, large) = (
        _replies(model, frames, _cut("Norm", budget=budget))[0].kept for budget in (10, 20)
    )
    assert (small.tokens, large.tokens) == (10, 20)
    per_token = (large.bytes - small.bytes) / 10
    text = model.loaded.model.get_decoder().config
    head = getattr(text, "head_dim", None) or text.hidden_size // text.num_attention_heads
    assert per_token == 2 * 4 * layers * text.num_key_value_heads * head
    assert small.clues is None


def test_a_later_frame_changes_nothing_of_what_is_kept_of_a_beginning(model, frames):
    cut = _cut("Norm", budget=12)
    model.forget()
    alone = _ids(_replies(model, frames[:4], cut))
    _replies(model, frames, cut)
    assert _ids(_replies(model, frames[:4], cut)) == alone


@pytest.mark.parametrize(
    ("method", "message"),
    [
        (f"{__name__}:TooMany", "tokens of frames where the budget is 9"),
        ("nowhere:Method", "the method nowhere:Method of a cache cannot be made"),
        (f"{METHODS}:Nothing", "cannot be made"),
    ],
)
def test_methods_that_fail_are_told_in_one_line(method, message, model, frames):
    with pytest.raises(ModelError, match=message) as raised:
        _replies(model, frames, CacheCut(method=method, budget=9))
    read_one_line(raised)


def test_without_frames_there_is_nothing_to_cut(model):
    with pytest.raises(ModelError, match="a cache that is cut needs frames") as raised:
        _replies(model, ["What is it?"], _cut("Norm"))
    read_one_line(raised)


@pytest.mark.parametrize("options", [{"share_prefix": "false"}, {"attention": "window:30"}])
def test_models_without_such_a_cache_refuse(options, frames):
    model = load("qwen2.5-vl-tiny", options, 0)
    with pytest.raises(ModelError, match="cache") as raised:
        _replies(model, frames, _cut("Norm", budget=9))
    read_one_line(raised)


@pytest.mark.parametrize("method", [*ALL, "EightBits"])
def test_of_the_current_view_alone_nothing_is_cut(method, model, frames):
    cut = _cut(method, frames=() if method == "Frames" else None, budget=9, clues=(0,))
    replies = _replies(model, frames[:1], cut)
    assert _ids(replies) == _ids(_replies(model, frames[:1]))
    assert replies[0].kept.tokens == 0
    assert replies[0].kept.clues is None  # the only clue is in view


def test_eight_bits_are_kept_of_everything_whatever_the_budget_is(model, frames):
    whole = _replies(model, frames, _cut("Norm"))[0].kept
    kept = _replies(model, frames, _cut("EightBits", budget=9))[0].kept
    assert kept.tokens == whole.tokens
    assert kept.bytes < 0.32 * whole.bytes


def test_frames_are_kept_with_the_marks_around_them(model, frames):
    pieces = model.pieces(user(*frames, "What?"))
    opening, last = split_at_last_frame(pieces)
    owners = owners_of(pieces[opening:last])
    begins, ends = (
        model.loaded.tokenizer.convert_tokens_to_ids(f"<|vision_{name}|>")
        for name in ("start", "end")
    )
    number = 0
    for piece, owner in zip(pieces[opening:last], owners, strict=True):
        if isinstance(piece, int):
            assert owner == (number - 1 if piece == ends else number)
            assert piece in (begins, ends)
        else:
            assert owner == number
            number += 1


def test_a_budget_of_nothing_keeps_nothing(model, frames):
    for method in ("Sinks", "Norm", "Question", "Merge"):
        assert _replies(model, frames, _cut(method, budget=0))[0].kept.tokens == 0
