"""The requests of every context, by every family and in every mode: replies are those of encoding
everything alone."""

from dataclasses import dataclass

import pytest
import torch
from PIL import Image

from infthor_eval.formats.frames import FrameRef
from model_adapters import Part, Transcript

from ..asking import load_saved, require_same, talk_of, up_to, user
from ..checkpoints import FAMILIES

NEW = 5
ADAPTERS = {family: family for family in FAMILIES} | dict.fromkeys(
    ("llava", "idefics3", "deepseek-vl-1.3b"), "hf-vlm"
)
MODES = {
    "shared": {"batch_size": "1"},
    "chunked": {"batch_size": "1", "chunk_tokens": "50"},
    "offloaded": {"kv_offload": "true"},
    "batched": {"batch_size": "3", "chunk_tokens": "20"},
}


@dataclass(frozen=True)
class Shape:
    """What questions are asked on: a context and their texts."""

    context: tuple[Part, ...]
    questions: tuple[str, ...] = ("\nWhat is it?",)


@pytest.fixture(scope="module")
def shapes(make_frames):
    """In the order in which a run comes to them: each is left for the next with its prefix still
    encoded."""
    frames = make_frames(7, seed=3)
    steps = [part for frame in frames[:3] for part in (frame, "<|act|>MoveAhead<|act|>")]
    questions = (
        "\nIs there a mug?",
        "\nWhere was the mug before you put it there?",
        "\nHow many plates did you see?",
    )
    return {
        "clues": [Shape((frames[4],)), Shape((frames[0], frames[4]), questions[:2])],
        "trajectory": [Shape(tuple(frames), questions)],
        "interleaved": [Shape(("Your main goal: wash the cup.", *steps, frames[5]), questions[:2])],
        "truncated": [Shape(tuple(frames[-4:]), questions[:2])],
        # The window moves back over the trajectory; then two windows that begin alike.
        "haystack": [Shape(tuple(frames[at : at + 3])) for at in (4, 2, 0)]
        + [Shape(tuple(frames[:5]))],
        "published size": [
            Shape(("Goal: wash the cup. ", *make_frames(2, 300, 300, seed=4), "RotateLeft"))
        ],
    }


@pytest.fixture(scope="module", params=ADAPTERS)
def family(request):
    return str(request.param)


@pytest.fixture(scope="module")
def build(family, checkpoints):
    def build(options):
        given = {"dtype": "float32", "max_tokens": 0, **options}
        return load_saved(ADAPTERS[family], checkpoints[family], **given)

    return build


@pytest.fixture(scope="module")
def alone(build):
    """The family's model without sharing; of hf-vlm, transformers' own processor and generate."""
    model = build({"share_prefix": "false", "chunk_tokens": "1000000"})
    yield model
    model.close()


@pytest.fixture(scope="module")
def expected(alone, shapes):
    return {name: _ask(alone, alone.conversation(), listed) for name, listed in shapes.items()}


def _prompt(shape):
    """The context with its first question, as a conversation has it: texts that touch are one."""
    talk = Transcript()
    talk.append(*shape.context, shape.questions[0])
    return talk.turns


def _ask(model, talk, shapes):
    """Ids and context tokens of all replies, asked for as a run asks: one conversation, rewound."""
    start, heard = talk.mark(), []
    for shape in shapes:
        talk.append(*shape.context)
        after = talk.mark()
        if model.capabilities.batch_size > 1:
            heard += talk.replies([[text] for text in shape.questions], up_to(NEW))
        else:
            for text in shape.questions:
                talk.rewind(after)
                talk.append(text)
                heard.append(talk.reply(up_to(NEW)))
        talk.rewind(start)
    return [(reply.token_ids, reply.n_context_tokens) for reply in heard]


@pytest.mark.parametrize("mode", MODES)
def test_replies_are_those_of_encoding_everything_for_each(build, shapes, expected, mode):
    model = build(MODES[mode])
    if "batch_size" in MODES[mode]:
        assert model.capabilities.batch_size == int(MODES[mode]["batch_size"])
    talk = model.conversation()
    assert {name: _ask(model, talk, listed) for name, listed in shapes.items()} == expected
    model.close()


def test_replies_depend_on_the_request(expected):
    replies = [ids for heard in expected.values() for ids, _ in heard]
    assert len(set(replies)) > len(replies) / 2


@pytest.fixture(scope="module")
def plainly(checkpoints, shapes, answer_plainly):
    """What transformers makes of the first question of each shape."""
    prompts = [_prompt(listed[0]) for listed in shapes.values()]
    return answer_plainly({checkpoints[name]: prompts for name in ADAPTERS}, NEW)


def test_ids_and_replies_are_those_of_transformers_own_processor_and_generate(
    family, build, shapes, checkpoints, plainly
):
    model = build({"chunk_tokens": "50"})
    for listed, (ids, reply) in zip(shapes.values(), plainly[checkpoints[family]], strict=True):
        require_same(model, _prompt(listed[0]), ids, reply, NEW)


def _received(model, talk):
    """Of one reply: the tokens that had been encoded before, and the tokens and positions that
    reach the text model."""
    fed = []
    text_model = model._loaded.model.get_decoder()
    hook = text_model.register_forward_pre_hook(
        lambda _, args, kwargs: fed.append(kwargs), with_kwargs=True
    )
    reply = talk.reply(up_to(1))
    hook.remove()
    n_positions = sum(call["position_ids"].shape[-1] for call in fed)
    return reply.n_cached_tokens, sum(call["inputs_embeds"].shape[1] for call in fed), n_positions


@pytest.mark.parametrize("mode", ["alone", "chunked"])
def test_the_model_receives_as_many_tokens_as_were_counted(build, alone, shapes, mode):
    model = alone if mode == "alone" else build(MODES[mode])
    for listed in shapes.values():
        talk = talk_of(model, _prompt(listed[0]))
        n_cached, n_fed, n_positions = _received(model, talk)
        assert n_cached + n_fed == talk.n_tokens
        assert n_positions == n_fed
        assert n_cached == 0 or mode != "alone"


def test_a_black_and_a_white_frame_give_different_logits(build, tmp_path):
    model = build({})
    logits = []
    for colour in ("black", "white"):
        path = tmp_path / f"{colour}.png"
        Image.new("RGB", (300, 300), colour).save(path)
        logits.append(model.encode(model.pieces(user(FrameRef(path), "\nIs it bright?"))))
    assert (logits[0] - logits[1]).abs().max() > 1e-3
    assert torch.isfinite(torch.stack(logits)).all()
