"""Whether clue frames show an eye the answer, by the object that is asked about."""

import numpy as np
import pytest
from PIL import Image

from infthor_eval.formats.step_log import ObjectInFrame
from infthor_eval.formats.trajectory import ExpertPlan, InitAction, Scene, Trajectory
from infthor_eval.formats.twins import PairedQuestion
from infthor_eval.generation.twins.comparison import Difference, World
from infthor_eval.generation.twins.kinds import Worlds
from infthor_eval.generation.twins.pairing import AskedWorld
from infthor_eval.generation.twins.visibility import check_original, is_shown

from ..questions.logs import history, state

FRIDGE, OVEN = "Fridge|1|0|0", "Microwave|1|0|0"
TRAJECTORY = Trajectory(Scene("kitchen-1", InitAction(0.0, 0.9, 0.0)), ExpertPlan([]))
WORLDS = Worlds((TRAJECTORY, TRAJECTORY), frozenset({FRIDGE, OVEN}), frozenset({"Fridge"}))
LEFT, RIGHT = slice(0, 40), slice(60, 100)  # where fridge and microwave are, in columns


def question(kind="Fridge"):
    answers = (("yes",), ("no",))
    return PairedQuestion(
        f"Was the {kind} open?", "Was {} open?", "open_state", f"open_state: {kind}", answers, (0,),
        ((0,), (0,)), (False, False), (0.0, 0.0),
    )  # fmt: skip


@pytest.fixture
def world(tmp_path):
    """Makes a world of one frame, lighter in some columns, which shows both objects or none."""

    def make(name, lighter=None, seen=True):
        pixels = np.full((100, 100, 3), 100, np.uint8)
        if lighter is not None:
            pixels[:, lighter] += np.uint8(50)
        path = tmp_path / f"{name}.png"
        Image.fromarray(pixels).save(path)
        log = history({FRIDGE: state(FRIDGE), OVEN: state(OVEN)})
        log.steps[0].seen = {
            FRIDGE: ObjectInFrame(4000, (0, 0, 39, 99)),
            OVEN: ObjectInFrame(4000, (60, 0, 99, 99)),
        }
        if not seen:
            log.steps[0].seen = {}
        return World(log.steps, [name if lighter else "same"], [path])

    return make


def test_another_thing_that_changed_beside_it_does_not_show_the_answer(world):
    closed = world("closed")
    assert is_shown(question(), WORLDS, closed, world("a", LEFT))
    assert not is_shown(question(), WORLDS, closed, world("b", RIGHT))
    assert is_shown(question("Microwave"), WORLDS, closed, world("b", RIGHT))
    assert not is_shown(question(), WORLDS, closed, world("c", slice(0, 2)))


def test_where_nothing_that_is_asked_about_is_in_view_all_counts(world):
    closed = world("closed", seen=False)
    assert is_shown(question(), WORLDS, closed, world("b", RIGHT, seen=False))


def test_equal_pictures_show_nothing(world):
    assert not is_shown(question(), WORLDS, world("closed"), world("closed"))


def asked(*shown):
    """A world of one frame that shows some of what changed."""
    log = history({FRIDGE: state(FRIDGE), OVEN: state(OVEN)})
    log.steps[0].seen = {key: ObjectInFrame(4000, (0, 0, 39, 99)) for key in shown}
    return AskedWorld(log.steps, WORLDS.changed, 0)


def test_a_world_that_hides_what_the_other_shows_is_no_twin_of_the_episode():
    check_original(True, [], asked(FRIDGE), asked(OVEN))
    check_original(True, [], asked(), asked())
    with pytest.raises(Difference, match="that the other hides"):
        check_original(True, [], asked(FRIDGE, OVEN), asked(OVEN))


def test_of_two_edited_worlds_none_looks_as_the_episode():
    episode = asked(FRIDGE, OVEN).steps
    larger = asked(FRIDGE, OVEN)
    larger.steps[0].seen[FRIDGE] = ObjectInFrame(4100, (0, 0, 40, 99))
    check_original(False, episode, larger, asked(FRIDGE))
    check_original(False, [*episode, *episode], larger, asked(FRIDGE, OVEN))
    for pair in ((asked(FRIDGE, OVEN), larger), (larger, asked(FRIDGE, OVEN))):
        check_original(True, episode, *pair)
        with pytest.raises(Difference, match="a world looks as the episode does"):
            check_original(False, episode, *pair)
