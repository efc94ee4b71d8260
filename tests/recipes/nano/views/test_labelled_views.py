import re

import numpy as np
import pytest

from infthor_eval.errors import DataError
from recipes.nano.views.labelled_views import (
    ThingInView,
    read_views,
    views_of,
    write_views,
)


def some_views():
    frames = [np.full((4, 4, 3), grey, np.uint8) for grey in (10, 20)]
    cells = np.arange(9).reshape(3, 3)
    things = [
        ThingInView(0, "Mug", "CounterTop", True, False, False, cells),
        ThingInView(1, "Mug", None, True, True, False, cells[::-1]),
        ThingInView(1, "Fridge", None, False, False, True, cells.T),
    ]
    return views_of(frames, things)


def test_written_views_are_read_as_they_were(tmp_path):
    path = tmp_path / "kitchen-1.npz"
    write_views(path, some_views())
    views = read_views(path)
    assert views.frames[:, 0, 0, 0].tolist() == [10, 20]
    assert [views.names[at] for at in views.type] == ["Mug", "Mug", "Fridge"]
    assert [at < 0 or views.names[at] for at in views.receptacle] == ["CounterTop", True, True]
    assert views.view.tolist() == [0, 1, 1]
    assert views.loose.tolist() == [True, True, False]
    assert (views.held.tolist(), views.opened.tolist()) == (
        [False, True, False],
        [False, False, True],
    )
    assert views.pixels[1].tolist() == [[6, 7, 8], [3, 4, 5], [0, 1, 2]]


@pytest.mark.parametrize(
    ("array", "value", "problem"),
    [
        ("view", np.array([0, 1, 2], np.int32), "it names a view or a type that it does not have"),
        ("type", np.array([0, 1, 9], np.int16), "it names a view or a type that it does not have"),
        ("held", np.array([True]), "its columns have different lengths"),
        ("held", np.array([1.0, 0.0, 1.0]), "its held are float64 of 1 dimensions"),
        ("pixels", np.zeros(3, np.uint16), "its pixels are uint16 of 1 dimensions"),
        ("frames", np.zeros((2, 4, 4, 4), np.uint8), "its frames have 4 colours"),
    ],
)
def test_arrays_that_do_not_belong_together_are_refused(tmp_path, array, value, problem):
    path = tmp_path / "kitchen-1.npz"
    np.savez_compressed(path, **{**vars(some_views()), array: value})
    with pytest.raises(DataError, match=re.escape(f"{path}: {problem}; remove it")):
        read_views(path)


def test_a_file_of_something_else_is_refused(tmp_path):
    path = tmp_path / "kitchen-1.npz"
    path.write_bytes(b"nothing")
    with pytest.raises(DataError, match="no labelled views"):
        read_views(path)
    np.savez_compressed(path, frames=np.zeros(3))
    with pytest.raises(DataError, match="no labelled views"):
        read_views(path)
