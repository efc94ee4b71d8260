"""Every family by the same measure: the published tokens per frame, the contract, precision,
refusals."""

import pytest

from infthor_eval.errors import ModelError
from model_adapters import check_adapter, load

from ..asking import ask, load_saved, talk_of, up_to, user
from ..checkpoints import FAMILIES, twin

TOKENS = {"qwen2.5-vl": 121 + 2, "llava-onevision": 1485, "deepseek-vl": 576, "pixtral": 380}
NEW = 6


@pytest.fixture(scope="module")
def scene(make_frames):
    return make_frames(3, 300, 300, seed=4)


@pytest.fixture(scope="module", params=FAMILIES)
def family(request):
    return str(request.param)


@pytest.fixture(scope="module")
def model(family, checkpoints):
    loaded = load_saved(family, checkpoints[family])
    yield loaded
    loaded.close()


def _parts(scene):
    words = ("Goal: wash the cup. ", "MoveAhead", "\nWhat do you see now?")
    return [words[0], *scene[:2], words[1], scene[2], words[2]]


def test_a_frame_takes_the_published_number_of_tokens(family, model, scene):
    sizes = [talk_of(model, user(*scene[:count])).n_tokens for count in (1, 2)]
    assert sizes[1] - sizes[0] == TOKENS[family]
    assert model.tokens_per_frame(scene[0]) == TOKENS[family] - (2 if family == "qwen2.5-vl" else 0)


def test_the_tiny_model_is_the_saved_one_and_keeps_its_contract(family, model, scene):
    tiny = load(f"{family}-tiny", {}, seed=0)
    replies = [ask(each, *_parts(scene), new=NEW) for each in (tiny, model)]
    assert replies[0].token_ids == replies[1].token_ids
    check_adapter(tiny, frame_size=(200, 300))


def test_a_family_refuses_the_others_checkpoints(family, checkpoints):
    other = next(name for name in FAMILIES if name != family)
    with pytest.raises(ModelError, match="checkpoint, not"):
        load_saved(family, checkpoints[other])


def test_pixtral_refuses_another_llava(checkpoints, tmp_path):
    pixtral = twin("pixtral")
    vocabulary = {token: index for index, token in enumerate(("[IMG]", "<s>"))}
    tokenizer = pixtral.tokenizer()
    model = pixtral.model(tokenizer, pixtral.model_config(tokenizer), 0, "sdpa")
    tokenizer.get_vocab = lambda: vocabulary
    with pytest.raises(ModelError, match=r"no \[IMG_BREAK\] or no \[IMG_END\]"):
        pixtral.family(model, pixtral.image_processor(), tokenizer)
    model.config.vision_config.model_type = "clip_vision_model"
    with pytest.raises(ModelError, match="without Pixtral's vision tower"):
        pixtral.family(model, pixtral.image_processor(), tokenizer)


def test_frames_stay_between_texts_though_the_template_writes_images_first(frames):
    model = load("llava-onevision-tiny", {}, seed=0)
    pieces = model.pieces(user("Goal: wash. ", frames[0], "MoveAhead. ", frames[1], "What now?"))
    tokenizer = model._loaded.tokenizer
    image = tokenizer.convert_tokens_to_ids("<image>")
    written = tokenizer.decode([piece if isinstance(piece, int) else image for piece in pieces])
    assert "Goal: wash. <image>MoveAhead. <image>What now?" in written
    talk = model.conversation()
    talk.append("Goal: wash. ", frames[0], "MoveAhead. ")
    talk.reply(up_to(1))
    talk.append(frames[1], "What now?")
    assert talk.reply(up_to(1)).n_cached_tokens > model.tokens_per_frame(frames[0])
    model.close()
