"""Training of the small model on two scenes and a few steps: its data, and that the loss falls."""

import random
import re
import shutil

import msgspec
import numpy as np
import pytest
import torch
import transformers
from PIL import Image
from safetensors.torch import load_file

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.object_ids import object_type_of
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.storage.folders import packaged_folder
from infthor_eval.training.data import read_history, trajectory_names
from infthor_eval.training.encoding import Encoder
from infthor_eval.training.export import export
from model_adapters import check_adapter, load
from model_adapters.hf.families.qwen2_5_vl import NANO_FOLDER
from model_adapters.hf.prompting.prompt import Frame
from recipes.nano import steps
from recipes.nano.action_sampler import ActionSampler, SyntheticPlans, single_plans
from recipes.nano.architecture import BLOCK, PATCHES, build_untrained, image_processor
from recipes.nano.reading.asking import question_intro
from recipes.nano.reading.frame_units import read_frame_units
from recipes.nano.reading.network import ReadingNetwork
from recipes.nano.reading.renaming import Vocabulary
from recipes.nano.seeing.network import SeeingNetwork
from recipes.nano.seeing.view_dataset import ViewDataset
from recipes.nano.seen_objects import read_seen_frames
from recipes.nano.settings import (
    ActingSettings,
    NanoRecipe,
    ReadingSettings,
    VisionSettings,
)
from recipes.nano.spelling import spellings
from recipes.nano.stages import (
    TrainingData,
    corpus_texts,
    single_tokens,
    train_small_model,
    whiten_patches,
)

from ...helpers.bundled import bundled_name

SMALL = NanoRecipe(
    title="small",
    vision=VisionSettings(hidden=32, layers=2, steps=20, patches_per_step=600),
    hidden=80,
    layers=2,
    steps=6,
    reading=ReadingSettings(tokens_per_step=300),
    acting=ActingSettings(window_tokens=600, plans_per_step=2, text_plans_per_step=4),
    threads=1,
)


def _with_steps(vision, reading):
    """Return the recipe with other numbers of steps."""
    return msgspec.structs.replace(
        SMALL, vision=msgspec.structs.replace(SMALL.vision, steps=vision), steps=reading
    )


@pytest.fixture(scope="module")
def views(small_views):
    return ViewDataset(small_views, BLOCK)


@pytest.fixture(scope="module")
def loaded(small_set, views):
    """The untrained model."""
    types = views.units.types
    vocabulary = Vocabulary(np.array(types)[views.loose].tolist(), (), types)
    tokens = single_tokens([small_set], vocabulary, types)
    return build_untrained(SMALL, corpus_texts([small_set], types), tokens)


@pytest.fixture(scope="module")
def data(small_set, small_views):
    return TrainingData([small_set], small_views)


def test_whitened_filters_are_uncorrelated_on_the_views(loaded, views):
    seeing = SeeingNetwork(loaded.model.model.visual, views, image_processor())
    inputs = seeing.inputs(views.random_frames(20, np.random.default_rng(0)))
    whiten_patches(seeing.tower, inputs, seed=0)
    filters = seeing.tower.patch_embed.proj.weight.sum(2).flatten(1)
    outputs = inputs.flatten(0, 1) @ filters.T
    moments = outputs.T @ outputs / len(outputs)
    assert torch.allclose(moments, 0.25 * torch.eye(len(moments)), atol=0.02)


def test_units_of_frames_give_the_familys_own_features(loaded, views, small_set):
    refs = [seen.frame for seen in read_seen_frames([small_set])[:5]]
    SeeingNetwork(loaded.model.model.visual, views, image_processor())  # sets unused units to zero
    units = read_frame_units(refs, image_processor(), loaded.model.model.visual, views.units)
    network = ReadingNetwork(loaded, units, views.units)
    frames = [Frame(ref.digest, ref.size, (), ref) for ref in refs]
    with torch.no_grad():
        theirs = torch.stack(loaded.family.features([ref.load() for ref in refs]))
        ours = torch.stack(network.features(frames))
    assert ours.shape == (5, 9, 80)
    assert torch.allclose(ours, theirs, atol=5e-3)  # units are kept in half precision


def test_types_are_those_of_parts_and_slices():
    ids = (
        "Mug|+01.00|+00.90|-02.00",
        "Sink|-01.00|+00.50|+01.00|SinkBasin",
        "Apple|+1|+2|+3|AppleSliced_2",
    )
    assert [object_type_of(key) for key in ids] == ["Mug", "SinkBasin", "AppleSliced"]


@pytest.mark.parametrize("side", [84, 100, 168, 224, 300, 640])
def test_frames_of_any_size_have_as_many_patches(side):
    picture = Image.new("RGB", (side, side))
    patches = image_processor()(images=[picture], return_tensors="pt")["pixel_values"]
    assert len(patches) == PATCHES**2


def test_words_and_some_texts_of_several_are_tokens(loaded, views):
    tokens = loaded.tokenizer.tokenize(f"{question_intro()} Have you seen a mug?")
    assert len(tokens) == 5  # "Have you seen" is one
    names = [spelling for name in views.units.types for spelling in spellings(name)]
    assert np.mean([len(loaded.tokenizer.tokenize(name)) for name in names]) < 1.6
    assert len(loaded.tokenizer.tokenize(" tennis racket")) == 1


def test_a_server_takes_for_the_reply_what_comes_behind_the_prompt(loaded):
    bundled = transformers.AutoTokenizer.from_pretrained(packaged_folder(NANO_FOLDER))
    prompt = "<|vision_start|><|image_pad|><|vision_end|>\nQuestion: Have you seen a mug?"
    for tokenizer in (loaded.tokenizer, bundled):
        reply = tokenizer("a mug, a knife<|im_end|>")["input_ids"]
        message = tokenizer.parse_response(
            reply, prefix=tokenizer.decode(tokenizer(prompt).input_ids)
        )
        assert message == {"role": "assistant", "content": "a mug, a knife"}


def test_synthetic_plans_replace_objects_in_plan_and_actions():
    recorded = [
        ("pick up the mug", ["PickupObject Mug"]),
        ("pick up the butterknife", ["PickupObject ButterKnife"]),
        (
            "put the mug in the fridge",
            ["OpenObject Fridge", "PutObject Mug Fridge", "CloseObject Fridge"],
        ),
        (
            "put the egg in the microwave",
            ["OpenObject Microwave", "PutObject Egg Microwave", "CloseObject Microwave"],
        ),
        ("put the egg in the sinkbasin", ["PutObject Egg SinkBasin"]),
        ("go to the fridge", ["MoveAhead", "RotateLeft"]),
    ]
    rng, plans = random.Random(0), SyntheticPlans(recorded)
    assert {(plan, *actions) for plan, actions in (plans.sample(rng) for _ in range(200))} == {
        ("pick up the mug", "PickupObject Mug"),
        ("pick up the butterknife", "PickupObject ButterKnife"),
        (
            "put the mug in the fridge",
            "OpenObject Fridge",
            "PutObject Mug Fridge",
            "CloseObject Fridge",
        ),
        (
            "put the egg in the fridge",
            "OpenObject Fridge",
            "PutObject Egg Fridge",
            "CloseObject Fridge",
        ),
        (
            "put the mug in the microwave",
            "OpenObject Microwave",
            "PutObject Mug Microwave",
            "CloseObject Microwave",
        ),
        (
            "put the egg in the microwave",
            "OpenObject Microwave",
            "PutObject Egg Microwave",
            "CloseObject Microwave",
        ),
        ("put the egg in the sinkbasin", "PutObject Egg SinkBasin"),
    }
    assert not SyntheticPlans(recorded[-1:])


@pytest.fixture(scope="module")
def actions(loaded, small_set):
    return ActionSampler(Encoder(loaded), [small_set], SMALL.acting, SMALL.words)


def test_synthetic_plans_have_no_frame_and_loss_on_their_actions(loaded, actions):
    for plan in actions.synthetic_plans(random.Random(0)):
        assert not plan.frames
        ends = [
            at
            for at, piece in enumerate(plan.pieces)
            if piece == loaded.tokenizer.convert_tokens_to_ids("<|plan|>")
        ]
        assert plan.has_loss == tuple(at > ends[1] for at in range(len(plan.pieces)))


def test_histories_are_windows_or_single_plans(loaded, actions):
    drawn = [actions.histories(random.Random(seed)) for seed in range(20)]
    assert {len(histories) for histories in drawn} == {1, 2}
    mark = loaded.tokenizer.convert_tokens_to_ids("<|plan|>")
    assert all(
        plan.pieces.count(mark) == 2
        for histories in drawn
        for plan in histories
        if len(histories) == 2
    )


def test_single_plans_have_every_action_once_and_each_begins_as_a_trajectory_does(
    loaded, small_set
):
    data, ids = NiehSet(small_set), loaded.tokenizer
    for name in trajectory_names(data):
        _, segments = read_history(data, name, SMALL.words)
        alone = list(single_plans(Encoder(loaded), name, segments))
        texts = [ids.decode([one for one in plan.pieces if isinstance(one, int)]) for plan in alone]
        assert [re.findall(r"<\|act\|>(.*?)<\|act\|>", text) for text in texts] == [
            [action for action, _ in segment.steps] for segment in segments if segment.steps
        ]
        assert all(text.startswith("<|goal|>") for text in texts)


def test_what_cannot_be_read_is_skipped_and_reported(small_set, small_views, tmp_path):
    shutil.copytree(small_set, tmp_path / "set")
    (tmp_path / "set/metadata" / bundled_name("kitchen-2") / "traj_data.json").unlink()
    notes = []
    train_small_model(
        _with_steps(1, 1),
        TrainingData([tmp_path / "set"], small_views),
        tmp_path / "states",
        lambda _: None,
        notes.append,
    )
    assert any("trajectory is not in the set" in line for line in notes)


def test_a_set_without_questions_is_refused(small_set, small_views, tmp_path):
    shutil.copytree(small_set, tmp_path / "set")
    (tmp_path / "set/qa_set_small.csv").unlink()
    write_questions(tmp_path / "set/qa_set_none.csv", [])
    data = TrainingData([tmp_path / "set"], small_views)
    with pytest.raises(DataError, match="no question"):
        train_small_model(_with_steps(1, 1), data, tmp_path / "states", lambda _: None)


def test_training_is_the_same_for_a_seed_and_lowers_the_loss(data, tmp_path):
    losses = []
    for name in ("a", "b"):
        done = []
        model = train_small_model(SMALL, data, tmp_path / f"states {name}", done.append)
        export(model, tmp_path / name, title=SMALL.title, words=SMALL.words)
        losses.append([step.loss for step in done])
        assert [step.stage for step in done] == ["vision"] * 20 + ["reading"] * 6
    assert losses[0] == losses[1]
    assert sum(losses[0][15:20]) < 0.95 * sum(losses[0][:5])
    first, second = (load_file(tmp_path / name / "model.safetensors") for name in ("a", "b"))
    assert all(first[name].equal(second[name]) for name in first)
    assert len({file.stat().st_mode for file in (tmp_path / "a").iterdir()}) == 1  # for all alike
    options = {"pretrained": str(tmp_path / "a"), "dtype": "float32"}
    check_adapter(load("qwen2.5-vl-nano", options, seed=0))
    check_adapter(load("qwen2.5-vl", options, seed=0))


class Stopped(Exception):
    """Stands for a machine that goes down."""


@pytest.mark.parametrize("stopped_in", ["vision", "reading"])
def test_a_stopped_training_continues_to_the_same_weights(stopped_in, data, tmp_path, monkeypatch):
    recipe = _with_steps(7, 7)
    monkeypatch.setattr(steps, "_STEPS_PER_STATE", 3)
    whole = train_small_model(recipe, data, tmp_path / "whole", lambda _: None)

    def stop(step):
        if (step.stage, step.step) == (stopped_in, 4):
            raise Stopped

    done = []
    with pytest.raises(Stopped):
        train_small_model(recipe, data, tmp_path / "states", stop)
    continued = train_small_model(recipe, data, tmp_path / "states", done.append)
    in_stage = [step.step for step in done if step.stage == stopped_in]
    assert in_stage == [4, 5, 6, 7]  # from the state after the third one
    first, second = whole.model.state_dict(), continued.model.state_dict()
    assert all(first[name].equal(second[name]) for name in first)


def test_states_of_another_recipe_are_refused(data, tmp_path):
    recipe = _with_steps(1, 1)
    train_small_model(recipe, data, tmp_path, lambda _: None)
    other = msgspec.structs.replace(recipe, lr=1e-4)
    with pytest.raises(UsageError, match="recipe"):
        train_small_model(other, data, tmp_path, lambda _: None)
