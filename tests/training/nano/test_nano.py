"""Training of the small model on two scenes and a few steps: its data, and that the loss falls."""

import copy
import random
import shutil

import msgspec
import pytest
import torch
from safetensors.torch import load_file

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.object_ids import object_type_of
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.formats.step_log import iter_object_states, read_steps
from infthor_eval.training.encoding import Encoder
from infthor_eval.training.export import export
from infthor_eval.training.nano import stages
from infthor_eval.training.nano.architecture import build_untrained, image_processor
from infthor_eval.training.nano.frame_dataset import cell_coverage, read_frame_dataset
from infthor_eval.training.nano.network import NanoNetwork, spellings
from infthor_eval.training.nano.question_sampler import question_intro
from infthor_eval.training.nano.sampler import SequenceSampler, SyntheticPlans, corpus_texts
from infthor_eval.training.nano.settings import NanoRecipe, QuestionSettings, VisionSettings
from infthor_eval.training.nano.stages import train_small_model
from infthor_eval.training.nano.whitening import whiten_patches
from model_adapters import check_adapter, load

from ...helpers.bundled import bundled_name

SMALL = NanoRecipe(
    title="small",
    vision=VisionSettings(hidden=32, layers=2, grid=2, steps=20, frames_per_step=16, lr=1e-2),
    hidden=64,
    layers=2,
    text_steps=3,
    joint_steps=6,
    questions=QuestionSettings(per_step=8),
    windows_per_step=1,
    window_tokens=600,
    lr=1e-2,
    threads=1,
)


def _with_steps(vision, text, joint):
    """Return the recipe with other numbers of steps."""
    return msgspec.structs.replace(
        SMALL,
        vision=msgspec.structs.replace(SMALL.vision, steps=vision),
        text_steps=text,
        joint_steps=joint,
    )


@pytest.fixture(scope="module")
def blank(small_set):
    """The untrained model and its frames."""
    dataset = read_frame_dataset([small_set], image_processor(grid=2), grid=2)
    return build_untrained(
        SMALL, corpus_texts([small_set], dataset.types), [question_intro()]
    ), dataset


def test_labels_of_frames_are_those_of_the_logs(small_set, blank):
    _, dataset = blank
    data = NiehSet(small_set)
    index = dataset.index_by_digest()
    for folder in sorted((small_set / "metadata").iterdir()):
        for frame, step in list(zip(data.frames(folder.name), read_steps(folder), strict=True))[
            ::20
        ]:
            at = index[frame.digest]
            present = {
                name
                for name, there in zip(dataset.types, dataset.present[at], strict=True)
                if there
            }
            labels = {
                name for name, there in zip(dataset.types, dataset.shown[at], strict=True) if there
            }
            assert present == {object_type_of(key) for key in step.seen}
            assert labels <= set(step.object_log.visible) | present


def test_labels_of_cells_are_of_states_and_receptacles(small_set, blank):
    _, dataset = blank
    index = dataset.index_by_digest()
    data = NiehSet(small_set)
    n_held = n_open = n_related = 0
    for folder in sorted((small_set / "metadata").iterdir()):
        steps = read_steps(folder)
        for frame, step, states in zip(
            data.frames(folder.name), steps, iter_object_states(steps), strict=True
        ):
            at = index[frame.digest]
            held = {object_type_of(key) for key in step.seen if states[key].held}
            opened = {object_type_of(key) for key in step.seen if states[key].is_open}
            inside = {
                (object_type_of(key), object_type_of(states[key].parents[0]))
                for key in step.seen
                if states[key].parents
            }
            assert _labelled(dataset.types, dataset.cells.held[at]) == held
            assert _labelled(dataset.types, dataset.cells.opened[at]) == opened
            related = _labelled(dataset.relations, dataset.cells.related[at])
            assert related == inside & set(dataset.relations)
            n_held, n_open = n_held + len(held), n_open + len(opened)
            n_related += len(related)
    assert min(n_held, n_open, n_related) > 20


def _labelled(names, labels):
    """Return the names that any cell of a frame is labelled with."""
    return {name for name, there in zip(names, labels.any(0), strict=True) if there}


def test_whitened_filters_are_uncorrelated_on_the_frames(blank):
    loaded, dataset = blank
    tower = copy.deepcopy(loaded.model.model.visual)
    whiten_patches(tower, dataset.pixels, seed=0)
    filters = tower.patch_embed.proj.weight.sum(2).flatten(1)
    outputs = dataset.pixels.flatten(0, 1).float() @ filters.T
    moments = outputs.T @ outputs / len(outputs)
    assert torch.allclose(moments, 0.25 * torch.eye(len(moments)), atol=0.01)


def test_frames_are_what_the_familys_own_features_are_made_of(blank):
    loaded, dataset = blank
    network = NanoNetwork(loaded, dataset)
    frames = [FrameRef(seen.frame.path) for seen in dataset.seen[:5]]
    with torch.no_grad():
        theirs = torch.stack(loaded.family.features([frame.load() for frame in frames]))
        ours = network.frame_features(range(5))
    assert ours.shape == (5, 4, 64)
    assert torch.allclose(ours, theirs, atol=5e-3)  # pixels are kept in half precision


@pytest.mark.parametrize(
    ("box", "cells"),
    [
        ((0, 0, 299, 299), set(range(16))),
        ((0, 0, 74, 74), {0}),
        ((225, 225, 299, 299), {15}),
        ((100, 30, 110, 40), {1}),  # small, whole in one part
        ((70, 0, 80, 10), {0, 1}),  # small, half in each of two: of 11 columns 5 and 6
        ((145, 145, 154, 154), {5, 6, 9, 10}),  # small, in the middle
    ],
)
def test_where_a_box_lies(box, cells):
    cells_of_box = {
        at
        for at, there in enumerate(
            cell_coverage(torch.tensor([box]), torch.tensor([[300, 300]]), grid=4)[0]
        )
        if there
    }
    assert cells_of_box <= cells
    assert cells_of_box


def test_types_are_those_of_parts_and_slices():
    ids = (
        "Mug|+01.00|+00.90|-02.00",
        "Sink|-01.00|+00.50|+01.00|SinkBasin",
        "Apple|+1|+2|+3|AppleSliced_2",
    )
    assert [object_type_of(key) for key in ids] == ["Mug", "SinkBasin", "AppleSliced"]


def test_words_are_tokens(blank):
    loaded, dataset = blank
    tokens = loaded.tokenizer.tokenize(f"{question_intro()} Have you seen a mug?")
    assert len(tokens) == 1 + 6
    names = [spelling for name in dataset.types for spelling in spellings(name)]
    lengths = [len(loaded.tokenizer.tokenize(name)) for name in names]
    assert sum(lengths) / len(lengths) < 1.6


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


def test_synthetic_plans_have_no_frame_and_loss_on_their_actions(small_set, blank):
    loaded, dataset = blank
    sampler = SequenceSampler(Encoder(loaded), [small_set], dataset, SMALL)
    for plan in sampler.synthetic_plans(20):
        assert not plan.frames
        ends = [
            at
            for at, piece in enumerate(plan.pieces)
            if piece == loaded.tokenizer.convert_tokens_to_ids("<|plan|>")
        ]
        assert plan.has_loss == tuple(at > ends[1] for at in range(len(plan.pieces)))


def test_histories_are_windows_or_single_plans(small_set, blank):
    loaded, dataset = blank
    sampler = SequenceSampler(Encoder(loaded), [small_set], dataset, SMALL)
    assert len(sampler.histories(2, 5, single_plan_share=0.0)) == 2
    plans = sampler.histories(2, 5, single_plan_share=1.0)
    assert len(plans) == 5
    mark = loaded.tokenizer.convert_tokens_to_ids("<|plan|>")
    assert all(plan.pieces.count(mark) == 2 for plan in plans)


def test_what_cannot_be_read_is_skipped_and_reported(small_set, tmp_path):
    shutil.copytree(small_set, tmp_path / "set")
    (tmp_path / "set/metadata" / bundled_name("kitchen-2") / "traj_data.json").unlink()
    notes = []
    train_small_model(
        _with_steps(1, 1, 1),
        [tmp_path / "set"],
        tmp_path / "states",
        lambda _: None,
        notes.append,
    )
    assert any("trajectory is not in the set" in line for line in notes)


def test_a_set_without_questions_is_refused(small_set, tmp_path):
    shutil.copytree(small_set, tmp_path / "set")
    (tmp_path / "set/qa_set_small.csv").unlink()
    write_questions(tmp_path / "set/qa_set_none.csv", [])
    with pytest.raises(DataError, match="no question"):
        train_small_model(SMALL, [tmp_path / "set"], tmp_path / "states", lambda _: None)


def test_training_is_the_same_for_a_seed_and_lowers_the_loss(small_set, tmp_path):
    losses = []
    for name in ("a", "b"):
        steps = []
        model = train_small_model(SMALL, [small_set], tmp_path / f"states {name}", steps.append)
        export(model, tmp_path / name, title=SMALL.title, words=SMALL.words)
        losses.append([step.loss for step in steps])
        assert [step.stage for step in steps] == ["vision"] * 20 + ["text"] * 3 + ["joint"] * 6
    assert losses[0] == losses[1]
    assert sum(losses[0][15:20]) < 0.95 * sum(losses[0][:5])
    first, second = (load_file(tmp_path / name / "model.safetensors") for name in ("a", "b"))
    assert all(first[name].equal(second[name]) for name in first)
    options = {"pretrained": str(tmp_path / "a"), "dtype": "float32"}
    check_adapter(load("qwen2.5-vl-nano", options, seed=0))
    check_adapter(load("qwen2.5-vl", options, seed=0))


class Stopped(Exception):
    """Stands for a machine that goes down."""


@pytest.mark.parametrize("stopped_in", ["vision", "joint"])
def test_a_stopped_training_continues_to_the_same_weights(
    stopped_in, small_set, tmp_path, monkeypatch
):
    recipe = _with_steps(4, 2, 4)
    monkeypatch.setattr(stages, "_STEPS_PER_STATE", 3)
    whole = train_small_model(recipe, [small_set], tmp_path / "whole", lambda _: None)

    def stop(step):
        if (step.stage, step.step) == (stopped_in, 4):
            raise Stopped

    steps = []
    with pytest.raises(Stopped):
        train_small_model(recipe, [small_set], tmp_path / "states", stop)
    continued = train_small_model(recipe, [small_set], tmp_path / "states", steps.append)
    assert 0 < len(steps) < 10
    first, second = whole.model.state_dict(), continued.model.state_dict()
    assert all(first[name].equal(second[name]) for name in first)


def test_states_of_another_recipe_are_refused(small_set, tmp_path, monkeypatch):
    recipe = _with_steps(1, 1, 1)
    monkeypatch.setattr(stages, "_STEPS_PER_STATE", 1)
    train_small_model(recipe, [small_set], tmp_path, lambda _: None)
    other = msgspec.structs.replace(recipe, lr=1e-4)
    with pytest.raises(UsageError, match="recipe"):
        train_small_model(other, [small_set], tmp_path, lambda _: None)
