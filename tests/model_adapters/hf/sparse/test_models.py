"""Models that attend sparsely: replies, memory, and what is refused."""

import pytest

from infthor_eval.errors import ModelError, UsageError
from model_adapters import load
from model_adapters.hf.sparse import chosen

from ....helpers.refusals import read_one_line
from ...asking import load_saved, load_with, talk_of, up_to, user

WHOLE = ("window:90000", "sinks:8+window:90000", "vertical-slash:1", "block-sparse:9000")
SHAPES = ("sinks:4+window:30", "window:25", "vertical-slash:.2", "block-sparse:1")
QUESTIONS = ("\nWhat is it?", "\nWhere is the mug then?")
WAY = "It is a long way. " * 12
SMALL = {"chunk_tokens": 40, "device": "cpu"}


@pytest.fixture(autouse=True)
def short(monkeypatch):
    """Lets the few tokens of a test be chosen among."""
    for name, number in {
        "_BLOCK": 8,
        "_LAST": 8,
        "_FIRST_COLUMNS": 1,
        "_NEAR_BANDS": 2,
    }.items():
        monkeypatch.setattr(chosen, name, number)


@pytest.fixture(scope="module")
def sparse(checkpoints):
    """A model of a tiny checkpoint, by its family and options; the same one each time."""
    loaded = {}

    def get(family="qwen2.5-vl", **options):
        key = (family, *sorted(options.items()))
        if key not in loaded:
            loaded[key] = load_saved(family, checkpoints[family], **{**SMALL, **options})
        return loaded[key]

    yield get
    for model in loaded.values():
        model.close()


def _ask_all(model, frames, *, new=8):
    """Replies to questions behind the same frames, one after the other and together."""
    talk = talk_of(model, user(*frames[:4], WAY, frames[4]))
    start = talk.mark()
    alone = []
    for question in QUESTIONS:
        talk.append(question)
        alone.append(talk.reply(up_to(new)).token_ids)
        talk.rewind(start)
    together = talk.replies([[question] for question in QUESTIONS], up_to(new))
    assert [reply.token_ids for reply in together] == alone
    return alone


@pytest.mark.parametrize("family", ["qwen2.5-vl", "llava-onevision", "pixtral"])
@pytest.mark.parametrize("attention", WHOLE)
@pytest.mark.parametrize("positions", ["ceiling", "cache"])
def test_what_sees_the_whole_context_replies_as_dense_attention(
    family, attention, positions, sparse, frames
):
    turned = {"positions": positions} if attention.startswith("sinks") else {}
    ours = sparse(family, attention=attention, **turned)
    assert _ask_all(ours, frames) == _ask_all(sparse(family), frames)


@pytest.mark.parametrize("attention", SHAPES)
@pytest.mark.parametrize("unit", ["tokens", "frames"])
def test_replies_do_not_depend_on_what_was_asked_before(attention, unit, sparse, frames):
    model = sparse(attention=attention, attention_unit=unit)
    model.forget()
    first = _ask_all(model, frames)
    assert first != _ask_all(sparse(), frames)
    other = talk_of(model, user(*frames[:2], "What is it?"))
    other.reply(up_to(3))
    talk_of(model, user(*frames, WAY, "What is it?")).reply(up_to(3))
    assert _ask_all(model, frames) == first
    model.forget()
    assert _ask_all(model, list(reversed(frames))) != first
    assert _ask_all(model, frames) == first


@pytest.mark.parametrize("attention", SHAPES)
def test_questions_at_moments_do_not_see_what_comes_later(attention, sparse, frames):
    """Beginnings of one sequence, asked together with its end."""
    model = sparse(attention=attention)
    at_moments = [(*frames[:n], WAY, *frames[n : n + 1], QUESTIONS[0]) for n in (1, 3, 5)]
    alone = []
    for parts in at_moments:
        model.forget()
        alone.append(talk_of(model, user(*parts)).reply(up_to(6)).token_ids)
    model.forget()
    together = model.answer_each([user(*parts) for parts in at_moments], up_to(6))
    assert [reply.token_ids for reply in together] == alone
    for number, parts in enumerate(at_moments):
        assert talk_of(model, user(*parts)).reply(up_to(6)).token_ids == alone[number]


def test_chunks_do_not_decide_what_a_window_sees(sparse, checkpoints, frames):
    shape = {"attention": "sinks:4+window:30"}
    expected = _ask_all(sparse(**shape), frames)
    for chunk in (7, 400):
        options = {**SMALL, "chunk_tokens": chunk, **shape}
        model = load_saved("qwen2.5-vl", checkpoints["qwen2.5-vl"], **options)
        assert _ask_all(model, frames) == expected


@pytest.mark.parametrize("words", [False, True])
def test_the_cache_of_a_window_does_not_grow(words, sparse, frames, language_models):
    options = {**SMALL, "attention": "sinks:4+window:50", "max_tokens": 0}
    model = (
        load_saved("hf-lm", language_models / "llama", **options)
        if words
        else sparse(**{name: options[name] for name in ("attention", "max_tokens")})
    )
    sizes = []
    for n in (10, 40, 160):
        parts = (WAY * n,) if words else frames * n
        model.forget()
        talk_of(model, user(*parts, "What is it?")).reply(up_to(2))
        layer = model._prefix.cache.layers[0]
        assert layer.keys.shape[-2] < 200
        sizes.append(layer._buffers[0].shape[-2])
    assert len(set(sizes)) == 1


def test_language_models_read_a_long_text_sparsely(language_models):
    replies = []
    for attention in (None, *WHOLE[:2], "sinks:4+window:50"):
        options = SMALL if attention is None else {**SMALL, "attention": attention}
        model = load_saved("hf-lm", language_models / "llama", **options)
        replies.append(_ask_all(model, [WAY] * 5))
    assert replies[0] == replies[1] == replies[2] != replies[3]


def test_the_shape_is_in_the_identity(sparse):
    assert "attention" not in sparse().identity()
    model = sparse(attention="sinks:4+window:30", positions="cache")
    assert model.identity()["attention"] == {
        "shape": "sinks:4+window:30",
        "unit": "tokens",
        "positions": "cache",
    }
    assert "positions" not in sparse(attention="vertical-slash:.2").identity()["attention"]


BAD = ("window:0", "sinks:-1", "sinks:4", "window:30+sinks:4", "sinks:1e9+window:3", "window:²")
BAD += ("dense", "vertical-slash:0", "vertical-slash:0.0", "vertical-slash:2", "block-sparse:1.5")


@pytest.mark.parametrize("text", BAD)
def test_bad_shapes_are_refused_in_one_line(text, checkpoints):
    with pytest.raises(UsageError, match="is none of sinks:N\\+window:N, window:N") as raised:
        load("qwen2.5-vl", {"pretrained": str(checkpoints["qwen2.5-vl"]), "attention": text}, 0)
    read_one_line(raised)


@pytest.mark.parametrize(
    ("model", "options", "message"),
    [
        ("gemma2", {}, "needs a model all of whose layers attend by transformers' interface"),
        ("qwen3_5_text", {}, "without caps or states"),
        ("llama", {"rope": "dynamic:2"}, "with one set of rotary frequencies"),
        ("gpt2", {}, "the model's positions are none that can be turned; use positions=absolute"),
    ],
)
def test_models_that_cannot_are_refused_in_one_line(model, options, message, language_models):
    options = {"attention": "sinks:4+window:30", **options}
    with pytest.raises(ModelError, match=message) as raised:
        load_saved("hf-lm", language_models / model, **options)
    read_one_line(raised)


def test_it_needs_a_shared_prefix(checkpoints):
    with pytest.raises(UsageError, match="attention needs share_prefix=true"):
        load_saved(
            "qwen2.5-vl", checkpoints["qwen2.5-vl"], attention="window:9", share_prefix="false"
        )


def test_positions_that_are_learned_can_stay_as_they_are(language_models):
    options = {**SMALL, "attention": "sinks:4+window:30"}
    model = load_saved("hf-lm", language_models / "gpt2", **options, positions="absolute")
    dense = load_saved("hf-lm", language_models / "gpt2", **SMALL)
    assert _ask_all(model, [WAY] * 5) != _ask_all(dense, [WAY] * 5)


@pytest.mark.parametrize("attention", SHAPES[:2])
@pytest.mark.parametrize("chunk", [10, 24])
def test_a_batch_of_texts_goes_back_no_further_than_is_stored(attention, chunk, language_models):
    options = {**SMALL, "chunk_tokens": chunk, "attention": attention, "batch_size": 4}
    model = load_saved("hf-lm", language_models / "llama", **options)
    asked = [user(WAY * 2 + words) for words in ("It is long. Where?", "What is it then?")]
    fresh = []
    for turns in asked:
        model.forget()
        fresh.append(model.answer(turns, up_to(6)).token_ids)
    model.answer(asked[0], up_to(6))
    together = model.answer_each(asked, up_to(6))
    assert [reply.token_ids for reply in together] == fresh


CHOSEN = SHAPES[2:]


@pytest.mark.parametrize("attention", CHOSEN)
def test_what_is_asked_is_read_densely_however_long_it_is(attention, sparse, frames):
    model = sparse(attention=attention)
    long = WAY * 4 + "Where?"
    model.forget()
    fresh = talk_of(model, user(*frames, long)).reply(up_to(6)).token_ids
    model.forget()
    talk_of(model, user(*frames, "What?")).reply(up_to(2))
    assert talk_of(model, user(*frames, long)).reply(up_to(6)).token_ids == fresh


@pytest.mark.parametrize("attention", CHOSEN)
def test_what_was_read_before_a_frame_is_read_again_where_it_is_asked(attention, sparse, frames):
    model = sparse(attention=attention, chunk_tokens=100)
    for before in ((), frames[:3]):
        asked = user(*before, WAY, "Where?")
        model.forget()
        fresh = talk_of(model, asked).reply(up_to(6)).token_ids
        model.forget()
        talk_of(model, user(*before, WAY, frames[4], "What?")).reply(up_to(2))
        assert talk_of(model, asked).reply(up_to(6)).token_ids == fresh


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"positions": "cache"}, "positions needs attention=sinks:N\\+window:N"),
        ({"positions": "cache", "attention": "window:9"}, "positions needs attention=sinks"),
        ({"attention_unit": "frames"}, "attention_unit needs attention; leave it out"),
    ],
)
def test_options_without_effect_are_refused(options, message, checkpoints):
    with pytest.raises(UsageError, match=message):
        load_with("qwen2.5-vl", pretrained=checkpoints["qwen2.5-vl"], **options)
