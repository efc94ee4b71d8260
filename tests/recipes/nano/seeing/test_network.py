import numpy as np

from recipes.nano.seeing.network import cell_shares, token_labels
from recipes.nano.seeing.units import Role
from recipes.nano.seeing.view_dataset import ViewDataset

from .views import BLOCK, cells, thing, write

CELL = 625  # pixels of a cell of 25 x 25


def labels_of(tmp_path, *things):
    """The labels of one frame by type and role, [2, 2] tokens; and what is unclear by type."""
    path, _ = write(tmp_path, "kitchen-1", 1, [*things, thing(0, "Bed", cells((0, 0), pixels=80))])
    dataset = ViewDataset([path], BLOCK)
    batch = dataset.frames(np.array([0]), np.zeros(1, bool))
    labels, unclear = token_labels(batch, BLOCK, CELL, len(dataset.units.types))

    def told(name, role=Role.SHOWN):
        return labels[0, :, role, dataset.units.index(name)].reshape(2, 2).tolist()

    def may_be(name):
        return unclear[0, :, dataset.units.index(name)].reshape(2, 2).tolist()

    return told, may_be


def test_a_thing_is_where_most_of_it_is(tmp_path):
    pixels = cells((0, 0), pixels=400) + cells((0, 2), pixels=70) + cells((2, 0), pixels=150)
    told, may_be = labels_of(tmp_path, thing(0, "Mug", pixels))
    assert told("Mug") == [[True, False], [True, False]]
    assert may_be("Mug") == [[False, True], [False, False]]


def test_a_large_thing_is_wherever_it_covers_much(tmp_path):
    counter = cells((2, 0), (2, 1), (3, 0), (3, 1), pixels=600) + cells((2, 2), (3, 2), pixels=400)
    told, _ = labels_of(tmp_path, thing(0, "CounterTop", counter, loose=False))
    assert told("CounterTop") == [[False, False], [True, True]]


def test_what_is_tiny_is_not_told_and_not_denied(tmp_path):
    told, may_be = labels_of(tmp_path, thing(0, "Mug", cells((0, 0), pixels=20)))
    assert told("Mug") == [[False, False], [False, False]]
    assert may_be("Mug") == [[True, False], [False, False]]


def test_each_role_has_its_own_label(tmp_path):
    told, _ = labels_of(
        tmp_path,
        thing(0, "Mug", cells((0, 0), pixels=300), "Shelf"),
        thing(0, "Apple", cells((3, 2), pixels=300), "CounterTop", held=True),
        thing(0, "Drawer", cells((0, 3), pixels=300), "Dresser", loose=False, opened=True),
    )
    top_left, bottom_right = [[True, False], [False, False]], [[False, False], [False, True]]
    nowhere = [[False, False], [False, False]]
    assert told("Mug", Role.HELD) == told("Mug", Role.OPEN) == nowhere
    assert told("Shelf", Role.AROUND) == top_left
    assert told("Shelf") == nowhere
    assert told("Apple", Role.HELD) == told("Apple") == bottom_right
    assert told("CounterTop", Role.AROUND) == nowhere  # what is held is in nothing
    assert told("Drawer", Role.OPEN) == [[False, True], [False, False]]
    assert told("Dresser", Role.AROUND) == nowhere  # a drawer is always there


def test_shares_of_a_cell_are_one_together(tmp_path):
    path, _ = write(
        tmp_path,
        "kitchen-1",
        1,
        [
            thing(0, "Mug", cells((0, 0), pixels=100)),
            thing(0, "Table", cells((0, 0), (0, 1), pixels=225), loose=False),
        ],
    )
    dataset = ViewDataset([path], BLOCK)
    batch = dataset.frames(np.array([0]), np.zeros(1, bool))
    shares = cell_shares(batch, CELL, 2)
    assert np.allclose(shares.sum(-1), 1)
    # pixels of mug, table and all else; those of the mug count four times
    assert np.allclose(shares[0, 0], np.array([400, 225, 300]) / 925)
    assert np.allclose(shares[0, 1], np.array([0, 225, 400]) / 625)
    assert np.allclose(shares[0, 2:], [0, 0, 1])
