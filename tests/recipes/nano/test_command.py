"""The command of the recipe: which recipes there are, what it refuses, its first steps."""

import pytest

from infthor_eval.errors import UsageError
from infthor_eval.formats.object_ids import Words
from model_adapters import check_adapter, load
from recipes.nano.__main__ import command, read_nano_recipe

from ...helpers.command_line import option_words

TINIEST = {
    "views": {"count": 1, "arrangements": 1},
    "vision": {"hidden": 32, "layers": 1, "steps": 2, "patches_per_step": 600},
    "reading": {"tokens_per_step": 300},
    "acting": {"window_tokens": 600, "plans_per_step": 2, "text_plans_per_step": 2},
}


def test_settings_are_changed_by_their_dotted_names():
    small = read_nano_recipe("small", {"vision.steps": "300", "words": "natural"})
    assert (small.scenes.count, small.vision.hidden, small.steps) == (96, 128, 2000)
    assert (small.vision.steps, small.words) == (300, Words.NATURAL)
    assert read_nano_recipe("tiny", {}).vision.hidden == 96


@pytest.mark.parametrize(
    ("name", "changes", "problem"),
    [
        ("smal", {}, "small"),
        ("small", {"vision.widht": "3"}, "small.yaml: not a recipe"),
        ("small", {"vision.hidden": "33"}, "use a multiple of 32"),
    ],
)
def test_a_recipe_that_is_none_is_refused(name, changes, problem):
    with pytest.raises(UsageError, match=problem):
        read_nano_recipe(name, changes)


def test_its_first_steps_give_a_checkpoint_that_the_adapter_loads(small_set, tmp_path):
    settings = [f"{part}.{key}={value}" for part in TINIEST for key, value in TINIEST[part].items()]
    settings += ["hidden=80", "layers=2", "steps=2", "threads=1"]
    words = option_words(recipe="tiny", data=small_set, out=tmp_path)
    changes = [word for setting in settings for word in ("--set", setting)]
    command.main([*words, *changes], standalone_mode=False)
    check_adapter(load("qwen2.5-vl-nano", {"pretrained": str(tmp_path / "checkpoint")}, seed=0))
