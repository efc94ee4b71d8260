"""The frames that a trajectory's file says were retrieved, as the published script shows them."""

import pytest
from PIL import Image, ImageChops

from infthor_eval.errors import DataError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.plans.history.forms import history_named
from infthor_eval.plans.history.past import Past
from infthor_eval.plans.history.recalled import MemoryChoice
from infthor_eval.plans.history.retrieved import retrieved_steps
from infthor_eval.plans.history.segments import PlanSegment

from ...helpers.refusals import read_one_line
from ...helpers.trajectories import FORK, cut_trajectory, write_trajectories

# The first frame is in no entry. Action 1 has two frames, of which the last one shows its outcome.
IMAGES = [(at, f"{n:09d}.png") for at, n in ((0, 1), (1, 2), (1, 3), (2, 4), (9, 11))]


@pytest.fixture
def trajectory(tmp_path):
    """Makes a trajectory whose file has this retrieved."""

    def make(retrieved, images=IMAGES):
        listed = [{"low_idx": action, "image_name": name, "high_idx": 0} for action, name in images]
        document = cut_trajectory(FORK) | {"retrieved_image": retrieved, "images": listed}
        (read,) = iter_trajectories(write_trajectories(tmp_path / "data", document))
        return read

    return make


def test_names_are_looked_up_in_images_with_the_suffix_of_either_format(trajectory):
    names = ["000000000.png", "000000001.jpg", "000000002.png", "000000004.png"]
    read = trajectory({"3": {"top20": names, "top2": names[:2]}})
    assert retrieved_steps(read, 3, 20) == [0, 1, 2, 3]
    assert retrieved_steps(read, 3, 2) == [0, 1]


NOTHING = "(nothing was retrieved before this action)"


@pytest.mark.parametrize(
    ("retrieved", "expected"),
    [
        (None, f'retrieved_image["3"]["top20"] is not in the file {NOTHING}; take'),
        ({"2": {"top20": []}}, f"{NOTHING}; take --history frames:20"),
        ({"3": {"top5": [], "top10": []}}, "(it has top10, top5); take --history frames:20"),
        ({"3": {"top20": ["000000099.png"]}}, "'000000099.png' is in no entry of images; restore"),
        (
            {"3": {"top20": ["000000011.png"]}},
            "'000000011.png' is taken after that action; restore",
        ),
        ({"3": {"top20": [1]}}, "is no list of frame names (Expected `str`, got `int`"),
        ({"3": [1]}, "is no list of frame names (Expected `object`, got `array`"),
    ],
)
def test_what_is_missing_or_wrong_is_told_with_its_place(trajectory, retrieved, expected):
    with pytest.raises(DataError, match=f"trajectory {FORK}: ") as caught:
        retrieved_steps(trajectory(retrieved), 3, 20)
    assert expected in read_one_line(caught)


def test_images_of_another_form_are_told(trajectory):
    with pytest.raises(DataError, match="images is no list of low_idx and image_name"):
        retrieved_steps(trajectory({"3": {"top20": []}}, images=[(-1, "000000001.png")]), 3, 20)


def test_they_are_shown_in_the_files_order_and_the_published_size(trajectory, tmp_path):
    colours = [(250, 0, 0), (0, 250, 0), (0, 0, 250), (90, 90, 90)]
    frames = []
    for number, colour in enumerate(colours):
        image = Image.new("RGB", (300, 300), colour)
        image.paste((255, 255, 255), (10, 20, 200, 130))
        image.save(tmp_path / f"{number}.png")
        frames.append(FrameRef(tmp_path / f"{number}.png"))
    steps = tuple((f"Act{number}", frames[number]) for number in (1, 2, 3))
    segments = [PlanSegment("go", "a goal", frames[0], steps)]
    read = trajectory({"3": {"top2": ["000000002.png", "000000000.png"]}})
    past = Past(segments, PlanSegment("pick", None, frames[3]), trajectory=read)
    history = history_named("retrieved:2", MemoryChoice())
    first, second, goal, present, plan = history.recall(past, lambda _: None)
    assert (goal, plan) == ("<|goal|>Your main goal: a goal<|goal|>", "<|plan|>Plan: pick<|plan|>")
    assert present == frames[3]
    for resized, number in ((first, 2), (second, 0)):
        expected = frames[number].load().resize((336, 336), Image.Resampling.LANCZOS)
        assert resized.size == (336, 336)
        assert ImageChops.difference(resized.load(), expected).getbbox() is None
    with pytest.raises(DataError, match="file is not known, which --history retrieved:K reads"):
        history.recall(Past(segments, past.present), lambda _: None)
