import pytest

from infthor_eval.household.affordances import preposition
from infthor_eval.household.wording import an, noun, plural


@pytest.mark.parametrize(
    ("kind", "words"),
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
def test_words_with_their_article(kind, words):
    assert an(noun(kind)) == words


@pytest.mark.parametrize(
    ("kind", "words"),
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
def test_plurals(kind, words):
    assert plural(noun(kind)) == words


def test_prepositions():
    assert [preposition(kind) for kind in ("Fridge", "CounterTop", "Plate", "Mug")] == ["in", "on", "on", "in"]
