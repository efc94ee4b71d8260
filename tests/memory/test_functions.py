"""A function of a user's file as a memory."""

import pytest
from PIL import Image

from infthor_eval.errors import ModelError, UsageError, UserCodeError
from infthor_eval.memory import open_memory

SOURCE = """
def recall(images, question, k=2):
    assert images[0].size == images[:1][0].size
    return [len(images) - 1, 0, len(images) - 1, 1][:k + 1]


def wrong(images, question):
    return ["first"]


def beyond(images, question):
    return [len(images)]


def other(frames):
    return []
"""


@pytest.fixture
def asked(tmp_path, observed):
    """Recalls what a function of the file names of a trajectory of five frames."""
    file = tmp_path / "mine.py"
    file.write_text(SOURCE)

    def ask(name, budget=None, tokens_per_frame=10, n_frames=5, **options):
        memory = open_memory(f"{file}:{name}", tuple(sorted(options.items())))
        recall = observed(memory, n_frames, tokens_per_frame, name=str(tmp_path))
        return [step.number for step in recall(budget=budget)]

    for number in range(5):
        Image.new("RGB", (8, 8)).save(tmp_path / f"{number}.png")
    return ask


def test_what_it_names_is_shown_once_in_time_order(asked):
    assert asked("recall") == [0, 4]
    assert asked("recall", k="3") == [0, 1, 4]


def test_the_most_important_fit_the_budget(asked):
    assert asked("recall", budget=19) == [4]
    assert asked("recall", budget=9) == []
    assert asked("recall", budget=9, tokens_per_frame=None) == [0, 4]


@pytest.mark.parametrize("name", ["wrong", "beyond"])
def test_what_is_no_number_of_an_image_is_an_error(asked, name):
    with pytest.raises(UserCodeError, match=r"return the numbers of images, from 0 to 4"):
        asked(name)


def test_a_question_before_the_first_image_is_answered_by_nothing(asked):
    with pytest.raises(UserCodeError, match=r"returned \[0\]; return nothing .* `return \[\]`"):
        asked("beyond", n_frames=0)


def test_other_functions_and_options_are_refused(asked):
    with pytest.raises(ModelError, match=r"write other\(images, question\)"):
        asked("other")
    with pytest.raises(UsageError, match="has no option n; it has k"):
        asked("recall", n=1)
