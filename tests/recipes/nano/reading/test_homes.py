"""Homes told otherwise: what frames show of them, and what is answered about them."""

import random

import pytest
import torch

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.question import Question
from recipes.nano.reading.episodes import Episode, World
from recipes.nano.reading.events import Event, Happening
from recipes.nano.reading.frame_units import ChangedFrame, FrameUnits
from recipes.nano.reading.homes import Homes
from recipes.nano.reading.renaming import Vocabulary
from recipes.nano.seeing.units import Role, Units
from recipes.nano.seen_objects import SeenFrame, SeenObject
from recipes.nano.settings import ReadingSettings

UNITS = Units(["Apple", "Fridge", "Laptop", "Mug"])
BOX = (0, 0, 9, 9)
LAPTOP = SeenObject("Laptop", BOX, True, "Desk", is_open=True)
FRIDGE = SeenObject("Fridge", BOX, True, is_open=False)
MUG = SeenObject("Mug", BOX, True, "Desk")
SEEN = [SeenFrame(None, (LAPTOP, FRIDGE, MUG))]
EPISODE = Episode((World((), (Happening(1, Event.OPENED, "Fridge"),)),))


@pytest.fixture(scope="module")
def drawn():
    """Homes, half of them renamed."""
    vocabulary = Vocabulary(["Apple", "Laptop", "Mug"], ["Fridge"])
    homes = Homes(vocabulary, UNITS, SEEN, [EPISODE], ReadingSettings(renamed=0.5))
    return [homes.draw(random.Random(seed)) for seed in range(40)]


def question(text, answer):
    return Question("kitchen-1", text, (0,), (answer,))


def test_only_what_nobody_opens_is_turned(drawn):
    assert {frozenset(), frozenset({"Laptop"})} == {home.turned for home in drawn}
    assert {(), (UNITS.index("Laptop"),)} == {home.turned_units for home in drawn}
    assert {home.order is None for home in drawn} == {True, False}


def test_what_is_turned_is_open_where_it_was_closed(drawn):
    turned = next(home for home in drawn if home.turned)
    assert [one.is_open for one in turned.objects((LAPTOP, FRIDGE, MUG))] == [False, False, None]
    as_it_was = next(home for home in drawn if not home.turned)
    assert as_it_was.objects((LAPTOP, FRIDGE, MUG)) == (LAPTOP, FRIDGE, MUG)


@pytest.mark.parametrize(
    ("text", "answer", "expected"),
    [
        ("Is the laptop open now?", "yes", "no"),
        ("Was the laptop open when you picked up the mug?", "no", "yes"),
        ("Was the fridge open?", "yes", "yes"),
        ("Is the laptop on the desk?", "yes", "yes"),
        ("Have you seen a laptop?", "yes", "yes"),
    ],
)
def test_recorded_answers_are_those_of_the_home(drawn, text, answer, expected):
    turned = next(home for home in drawn if home.turned)
    assert turned.answers(question(text, answer)) == [expected]


def test_units_are_turned_before_they_are_renamed():
    at = UNITS.index
    values = torch.full((1, 2, len(Role), len(UNITS.types)), -9.0)
    values[0, 0, Role.SHOWN, at("Laptop")] = 3.0  # shown in the first token, closed
    units = FrameUnits(values.half(), {"d": 0})
    order = list(range(len(UNITS.types)))
    order[at("Mug")], order[at("Laptop")] = at("Laptop"), at("Mug")
    frame = ChangedFrame("d", (9, 9), (), FrameRef("f"), tuple(order), (at("Laptop"),))
    changed = units.of(frame)
    assert (changed[:, Role.OPEN, at("Mug")] > 0).tolist() == [True, False]
    assert not (changed[:, Role.OPEN, at("Laptop")] > 0).any()
    assert (units.values[..., Role.OPEN, :] < 0).all()
