"""The shipped tables against the published ones."""

import json
from pathlib import Path

import yaml

from infthor_eval.household import affordances
from infthor_eval.household.affordances import SLICEABLE, goes_into
from infthor_eval.household.tasks import SAMPLED

PUBLISHED = Path(__file__).parents[1] / "goldens" / "affordances.json"
SHIPPED = yaml.safe_load(Path(affordances.__file__).with_name("affordances.yaml").read_text())


def test_the_tables_are_the_published_ones():
    published = json.loads(PUBLISHED.read_text())
    assert {name: published[name] for name in SHIPPED} == SHIPPED


def test_names_are_those_of_the_simulator():
    assert goes_into("Bottle", "Fridge") and not goes_into("Glassbottle", "Fridge")
    assert goes_into("PaperTowelRoll", "GarbageCan")
    assert goes_into("AppleSliced", "Microwave") and not goes_into("Statue", "SinkBasin")


def test_what_leaves_slices_can_be_sliced():
    assert {"Apple", "Bread", "Lettuce", "Potato", "Tomato"} == SLICEABLE


def test_every_goal_has_its_rooms():
    assert set(affordances.GOALS_BY_ROOM) == set(SAMPLED)
