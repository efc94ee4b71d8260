"""Recipes: those of the package are the paper's, and their models can be replaced."""

import shutil

import pytest

from infthor_eval.errors import UsageError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.published import published_tables
from infthor_eval.formats.qa_csv import write_questions
from infthor_eval.training.recipe import read_recipe, recipe_names

from ..helpers.command_line import option_words


def test_the_papers_recipes_are_table_5():
    (table,) = published_tables("training")
    final = {"final_goals", "final_text", "final_frames"}
    of_table = {row.name for row in table.rows}
    assert {*of_table, *final, "questions"} == {*recipe_names()}
    for row in table.rows:
        recipe, settings = read_recipe(row.name), dict(zip(table.columns, row.values, strict=True))
        assert recipe.max_tokens == settings["context tokens"]
        assert recipe.parallel.context == settings["context parallel"]
        assert recipe.model_args["pretrained"] in row.checkpoints
        optimizer = recipe.optimizer
        assert (optimizer.lr, optimizer.warmup_ratio, recipe.epochs) == (1e-5, 0.03, 3)
        assert set(recipe.freeze) == {"vision", "embeddings"}
        assert recipe.model == "llava-onevision"


def test_settings_are_changed_by_their_dotted_names():
    recipe = read_recipe(
        "infthor_64k", {"optimizer.lr": "2e-5", "model_args.dtype": "float32", "max_steps": "3"}
    )
    assert (recipe.optimizer.lr, recipe.optimizer.warmup_ratio, recipe.max_steps) == (2e-5, 0.03, 3)
    assert recipe.model_args == {
        "pretrained": "llava-hf/llava-onevision-qwen2-7b-ov-hf",
        "dtype": "float32",
    }


def test_an_unknown_recipe_is_told_with_the_nearest():
    with pytest.raises(UsageError, match="infthor_32k"):
        read_recipe("infthor_32")


@pytest.mark.parametrize("name", ["infthor_32k", "questions"])
def test_model_options_of_a_recipe_apply_to_its_own_model_alone(name):
    own = read_recipe(name).model
    other = read_recipe(name, {"model": "qwen2.5-vl-tiny", "model_args.dtype": "float32"})
    assert (other.model, other.model_args) == ("qwen2.5-vl-tiny", {"dtype": "float32"})
    assert read_recipe(name, {"model": own}).model_args == read_recipe(name).model_args
    same = read_recipe(name, {"model": own, "model_args.dtype": "float32"}).model_args
    assert same == {**read_recipe(name).model_args, "dtype": "float32"}


@pytest.mark.parametrize("name", ["infthor_32k", "questions", "final_text"])
def test_train_takes_another_model_than_the_recipes(name, bundled_set, tmp_path, run_cli):
    data = tmp_path / "set"
    shutil.copytree(bundled_set / "metadata/bedroom-1-seed7", data / "metadata/bedroom-1-seed7")
    if name == "questions":  # trajectories alone are enough for the others
        asked = NiehSet(bundled_set).questions
        questions = [item for item in asked if item.traj_id == "bedroom-1-seed7"]
        write_questions(data / "qa_set_small.csv", questions[:3])
    words = option_words(recipe=name, data=data, out=tmp_path / "out", model="qwen2.5-vl-tiny")
    words += ["--model-args", "dtype=float32", "--set", "max_steps=1"]
    words += ["--set", "sequences_per_step=1", "--set", "max_tokens=4000"]
    code, _, err = run_cli("train", *words)
    assert code == 0, err
    assert (tmp_path / "out/checkpoint/model.safetensors").is_file()
    assert "%|" not in err  # no progress bar of transformers
