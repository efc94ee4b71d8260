import numpy as np
import pytest

from infthor_eval.errors import DataError
from recipes.nano.seeing.view_dataset import ViewDataset, in_merge_order

from .views import BLOCK, GRID, cells, thing, write

NOT_MIRRORED = np.zeros(1, bool)


def pixels_of(patches):
    """The picture of patches in merge order, [side, side, 3]."""
    side = int(len(patches) ** 0.5)
    places = in_merge_order(np.arange(side**2).reshape(1, side, side), BLOCK)[0]
    picture = np.zeros((2 * side, 2 * side, 3), np.uint8)
    for place, patch in zip(places, patches, strict=True):
        row, column = divmod(int(place), side)
        picture[2 * row : 2 * row + 2, 2 * column : 2 * column + 2] = patch.reshape(2, 2, 3)
    return picture


@pytest.fixture
def two_rooms(tmp_path):
    big = cells((1, 1), (1, 2), pixels=50)
    kitchen = write(
        tmp_path,
        "kitchen-1",
        2,
        [
            thing(1, "Mug", big, "CounterTop"),
            thing(0, "SinkBasin", cells((3, 3), pixels=90), loose=False),
        ],
    )
    bedroom = write(tmp_path, "bedroom-1", 1, [thing(0, "Pillow", cells((0, 0), pixels=100))], 1)
    frames = np.concatenate([kitchen[1], bedroom[1]])
    return ViewDataset([kitchen[0], bedroom[0]], BLOCK), frames


def test_frames_have_their_pixels_and_things(two_rooms):
    dataset, frames = two_rooms
    assert len(dataset) == 3
    assert dataset.units.types == ("CounterTop", "Mug", "Pillow", "Sink")
    for view in range(3):
        batch = dataset.frames(np.array([view]), NOT_MIRRORED)
        assert np.array_equal(pixels_of(batch.patches[0]), frames[view])
    names = [dataset.units.types[at] for at in dataset.frames(np.arange(3), np.zeros(3, bool)).type]
    assert names == ["Sink", "Mug", "Pillow"]


def test_a_mirrored_frame_is_the_mirror_of_the_frame(two_rooms):
    dataset, frames = two_rooms
    batch = dataset.frames(np.array([1]), np.array([True]))
    assert np.array_equal(pixels_of(batch.patches[0]), frames[1][:, ::-1])
    order = in_merge_order(np.arange(16).reshape(1, 4, 4), BLOCK)[0]
    places = sorted(order[batch.pixels[0] > 0].tolist())
    assert places == [1 * GRID + 1, 1 * GRID + 2]  # it is in the middle
    sink = dataset.frames(np.array([0]), np.array([True]))
    assert order[sink.pixels[0] > 0].tolist() == [3 * GRID + 0]


def test_crops_are_parts_of_frames_with_something_in_them(two_rooms):
    dataset, frames = two_rooms
    batch = dataset.crops(64, np.random.default_rng(0))
    assert batch.patches.shape == (64, BLOCK**2, 12)
    parts = {
        part[:, ::step].tobytes(): (view, step)
        for view, frame in enumerate(frames)
        for top in range(0, 6, 2)
        for left in range(0, 6, 2)
        for part in [frame[top : top + 4, left : left + 4]]
        for step in (1, -1)
    }
    found = [parts[pixels_of(patches).tobytes()] for patches in batch.patches]
    assert {step for _, step in found} == {1, -1}
    assert {view for view, _ in found} == {0, 1, 2}
    assert set(batch.picture.tolist()) == set(range(64))
    # A fixture is the centre of few crops.
    assert sum(view == 0 for view, _ in found) < 16


def test_things_keep_the_pixels_that_they_have_in_the_whole_frame(two_rooms):
    dataset, _ = two_rooms
    batch = dataset.crops(64, np.random.default_rng(0))
    mug = dataset.units.index("Mug")
    assert set(batch.n_pixels[batch.type == mug].tolist()) == {100}
    assert set(batch.pixels[batch.type == mug].sum(1).tolist()) <= {50, 100}
    counter = dataset.units.index("CounterTop")
    assert set(batch.receptacle[batch.type == mug].tolist()) == {counter}


def test_the_same_random_numbers_give_the_same_batch(two_rooms):
    dataset, _ = two_rooms
    one, other = (dataset.crops(8, np.random.default_rng(5)) for _ in range(2))
    for name, array in vars(one).items():
        assert np.array_equal(array, getattr(other, name)), name


def test_views_of_other_sizes_are_refused(tmp_path, two_rooms):
    odd = tmp_path / "odd"
    odd.mkdir()
    path, _ = write(odd, "kitchen-9", 1, [thing(0, "Mug", np.full((2, 2), 99))])
    good, _ = write(odd, "kitchen-8", 1, [thing(0, "Mug", cells((0, 0), pixels=99))])
    with pytest.raises(DataError, match=r"kitchen-9\.npz: its views have another size"):
        ViewDataset([good, path], BLOCK)


def test_no_views_are_refused():
    with pytest.raises(DataError, match="no labelled views to learn from"):
        ViewDataset([], BLOCK)
