"""Recipes: those of the package are the paper's."""

import pytest

from infthor_eval.errors import UsageError
from infthor_eval.formats.published import published_tables
from infthor_eval.training.recipe import read_recipe, recipe_names


def test_the_papers_recipes_are_table_5():
    (table,) = published_tables("training")
    assert {"infthor_32k", "infthor_64k", "infthor_130k", "questions", "tiny"} == set(recipe_names())
    for row in table.rows:
        recipe, told = read_recipe(row.name), dict(zip(table.columns, row.values, strict=True))
        assert recipe.max_tokens == told["context tokens"]
        assert recipe.parallel.context == told["context parallel"]
        assert recipe.model_args["pretrained"] in row.checkpoints
        assert (recipe.optimizer.lr, recipe.optimizer.warmup_ratio, recipe.epochs) == (1e-5, 0.03, 3)
        assert set(recipe.freeze) == {"vision", "embeddings"}
        assert recipe.model == "llava-onevision"


def test_settings_are_changed_by_their_dotted_names():
    recipe = read_recipe("infthor_64k", {"optimizer.lr": "2e-5", "model_args.dtype": "float32", "max_steps": "3"})
    assert (recipe.optimizer.lr, recipe.optimizer.warmup_ratio, recipe.max_steps) == (2e-5, 0.03, 3)
    assert recipe.model_args == {"pretrained": "llava-hf/llava-onevision-qwen2-7b-ov-hf", "dtype": "float32"}


def test_an_unknown_recipe_is_told_with_the_nearest():
    with pytest.raises(UsageError, match="infthor_32k"):
        read_recipe("infthor_32")
