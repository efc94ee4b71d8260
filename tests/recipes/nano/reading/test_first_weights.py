"""What the decoder's heads do before any training."""

import pytest
import torch
from torch.nn.functional import gelu

from recipes.nano.architecture import GRID, build_untrained
from recipes.nano.reading.first_weights import set_first_weights
from recipes.nano.seeing.units import Role, Units
from recipes.nano.settings import NanoRecipe
from recipes.nano.spelling import spellings

LOOSE = ("Apple", "Book", "Knife", "Mug", "Plate")
FIXTURES = ("CounterTop", "Fridge", "Sink")
UNITS = Units([*LOOSE, *FIXTURES])
PLACE = 4  # the token in the middle of a frame
PHRASES = (" Is the", " open now?")


@pytest.fixture(scope="module")
def loaded():
    recipe = NanoRecipe(title="small", threads=1)
    texts = [text for name in UNITS.types for text in spellings(name)]
    loaded = build_untrained(recipe, [*texts, "yes", "no"], PHRASES)
    kinds = ([name in group for name in UNITS.types] for group in (LOOSE, FIXTURES))
    set_first_weights(loaded, UNITS, *kinds, GRID, seed=0)
    loaded.model.set_attn_implementation("eager")
    return loaded.model.eval(), loaded.tokenizer, loaded.family


def run(loaded, shown, *words):
    """What the decoder makes of words after a frame.

    Args:
        shown: type and role of what the middle of the frame shows.
    """
    model, tokenizer, family = loaded
    values = torch.full((1, GRID**2, len(Role), len(UNITS.types)), -9.0)
    for name, role in shown:
        values[0, PLACE, role, UNITS.index(name)] = 4.0
    merger = model.model.visual.merger.mlp[2]
    with torch.no_grad():
        weight = merger.weight[:, : len(UNITS)]
        features = torch.nn.functional.linear(gelu(values.flatten(2)), weight, merger.bias)[0]
    names = ("vision_start", "image_pad", "vision_end")
    start, pad, end = (tokenizer.convert_tokens_to_ids(f"<|{name}|>") for name in names)
    ids = torch.tensor([start, *[pad] * GRID**2, end, *(token(loaded, word) for word in words)])
    embeds = model.get_input_embeddings()(ids).detach()
    embeds[1 : 1 + GRID**2] = features
    positions = family.positions(ids, [(168, 168)], 0)
    with torch.no_grad():
        return model.get_decoder()(
            inputs_embeds=embeds[None], position_ids=positions, output_attentions=True
        )


def token(loaded, text):
    (number,) = loaded[1](text, add_special_tokens=False)["input_ids"]
    return number


def looks(loaded, shown, word, layer, head):
    """Where a head looks from a word after a frame: at the token before it, its nine, its end."""
    return run(loaded, shown, word).attentions[layer][0, head, -1]


def test_a_name_finds_the_part_of_the_frame_that_shows_the_thing(loaded):
    """And not itself, which is most alike."""
    shown = [("Mug", Role.SHOWN), ("Sink", Role.AROUND)]
    weights = looks(loaded, shown, " mug", layer=0, head=0)
    assert weights[1 + PLACE] > 0.9
    others = [
        looks(loaded, shown, word, layer=0, head=0)[1 + PLACE]
        for word in (" apple", " book", " knife", " plate")
    ]
    assert sum(others) / len(others) < 0.15 * weights[1 + PLACE]


def test_a_fixture_finds_what_is_in_it(loaded):
    shown = [("Mug", Role.SHOWN), ("Sink", Role.AROUND)]
    assert looks(loaded, shown, " sink", layer=0, head=1)[1 + PLACE] > 0.9
    assert looks(loaded, shown, " fridge", layer=0, head=1)[1 + PLACE] < 0.5


@pytest.mark.parametrize("word", [" fridge", " mug"])
def test_a_name_finds_the_part_of_the_frame_where_it_is_open(loaded, word):
    name = {" fridge": "Fridge", " mug": "Mug"}[word]
    opened, closed = (
        looks(loaded, shown, word, layer=0, head=4)[1 + PLACE]
        for shown in ([(name, Role.SHOWN), (name, Role.OPEN)], [(name, Role.SHOWN)])
    )
    assert opened > 0.9
    assert closed < 0.1 * opened


@pytest.mark.parametrize("word", [" fridge", " mug"])
def test_what_is_open_is_said_and_nothing_else_that_is_open(loaded, word):
    """Before any training, by the words "yes" and "no"."""
    name, other = {" fridge": ("Fridge", "Mug"), " mug": ("Mug", "Fridge")}[word]
    words = loaded[0].get_input_embeddings().weight.detach()
    towards_yes = words[token(loaded, "yes")] - words[token(loaded, "no")]
    both = [(name, Role.SHOWN), (other, Role.SHOWN)]
    opened, other_opened, closed = (
        run(loaded, [*both, *shown], " Is the", word, " open now?").last_hidden_state[0, -1]
        @ towards_yes
        for shown in ([(name, Role.OPEN)], [(other, Role.OPEN)], [])
    )
    assert opened > closed + 2
    assert abs(other_opened - closed) < 0.5 * (opened - closed)


def test_a_head_hands_on_nothing_of_what_it_looks_at_when_it_finds_nothing(loaded):
    """Tokens that got it would be looked at in its place, more than the part with the thing."""
    model, tokenizer, _ = loaded
    words = model.get_input_embeddings().weight
    sink, mug = (
        words[tokenizer(text, add_special_tokens=False)["input_ids"][0]]
        for text in ("<|vision_start|>", " mug")
    )
    contents = 1  # the second head hands on things
    width = model.config.text_config.hidden_size // 5
    rows = slice(contents * width, (contents + 1) * width)
    values = model.get_decoder().layers[0].self_attn.v_proj.weight[rows]
    assert (values @ mug).norm() > 0.5
    assert (values @ sink).norm() < 0.1 * (values @ mug).norm()


def test_names_of_one_thing_are_alike_in_all_spellings(loaded):
    model, tokenizer, _ = loaded
    words = model.get_input_embeddings().weight
    spelled = [tokenizer(text, add_special_tokens=False)["input_ids"] for text in spellings("Mug")]
    mugs = torch.stack([words[ids[0]] for ids in spelled if len(ids) == 1])
    (knife,) = tokenizer(" knife", add_special_tokens=False)["input_ids"]
    alike = torch.cosine_similarity(mugs[:1], mugs[1:])
    assert len(alike) > 1
    assert alike.min() > torch.cosine_similarity(mugs[:1], words[knife][None]).item() + 0.3
