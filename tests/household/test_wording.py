import pytest

from infthor_eval.household.affordances import preposition
from infthor_eval.household.wording import noun, plural, with_article


@pytest.mark.parametrize(
    ("object_type", "words"),
    [
        ("Mug", "a mug"),
        ("Apple", "an apple"),
        ("AlarmClock", "an alarm clock"),
        ("CoffeeTable", "a coffee table"),
        ("TVStand", "a TV stand"),
        ("CD", "a CD"),
        ("AppleSliced", "a sliced apple"),
        ("Ottoman", "an ottoman"),
        ("Boots", "boots"),
        ("BreadSliced", "sliced bread"),
    ],
)
def test_words_with_their_article(object_type, words):
    assert with_article(noun(object_type)) == words


@pytest.mark.parametrize(
    ("object_type", "words"),
    [
        ("Mug", "mugs"),
        ("Knife", "knives"),
        ("Potato", "potatoes"),
        ("TissueBox", "tissue boxes"),
        ("Dish", "dishes"),
        ("Candy", "candies"),
        ("Key", "keys"),
        ("Bread", "loaves of bread"),
    ],
)
def test_plurals(object_type, words):
    assert plural(noun(object_type)) == words


def test_prepositions():
    said = {name: preposition(name) for name in ("Fridge", "CounterTop", "Plate", "Mug")}
    assert said == {"Fridge": "in", "CounterTop": "on", "Plate": "on", "Mug": "in"}
