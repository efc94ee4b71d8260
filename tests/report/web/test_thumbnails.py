"""Pictures of a page: what comes first gets the room, and thumbnails before enlarged pictures."""

import base64
import io
import random
from functools import partial

import pytest
from PIL import Image

from infthor_eval.errors import DataError
from infthor_eval.report.web.thumbnails import ThumbnailStore


def noise(seed, side=300):
    return Image.frombytes("RGB", (side, side), random.Random(seed).randbytes(3 * side * side))


def size_of(picture):
    return Image.open(io.BytesIO(base64.b64decode(picture))).size


def test_each_picture_is_there_once_small_and_large():
    store = ThumbnailStore(1_000_000)
    assert [store.add(key, lambda: noise(0)) for key in ("a", "b", "a")] == [0, 1, 0]
    assert store.large == {0: 2, 1: 3}
    assert [size_of(picture) for picture in store.encoded] == [(132, 132)] * 2 + [(300, 300)] * 2
    assert store.n_left_out == 0


@pytest.mark.parametrize(("side", "large"), [(132, None), (300, (300, 300)), (768, (480, 480))])
def test_an_enlarged_picture_is_no_larger_than_the_frame_and_only_there_if_it_shows_more(
    side, large
):
    store = ThumbnailStore(10_000_000)
    store.add("a", lambda: noise(0, side))
    assert [size_of(store.encoded[number]) for number in store.large.values()] == (
        [large] if large else []
    )


def test_thumbnails_take_the_room_of_enlarged_pictures_and_the_first_ones_keep_theirs():
    alone = ThumbnailStore(10_000_000)
    alone.add("0", lambda: noise(0))
    small, large = map(len, alone.encoded)
    budget = 10 * small + large + large // 2
    store = ThumbnailStore(budget)
    numbers = [store.add(str(seed), lambda seed=seed: noise(seed)) for seed in range(10)]
    assert numbers == list(range(10))
    assert sum(map(len, store.encoded)) <= budget
    assert store.large == {0: 10}
    more = [store.add(str(seed), lambda seed=seed: noise(seed)) for seed in range(10, 60)]
    assert None in more
    assert store.large == {}
    assert store.n_left_out == more.count(None)
    assert sum(map(len, store.encoded)) <= budget


@pytest.mark.parametrize("budget", [3_000, 40_000, 200_000, 10_000_000])
def test_pictures_added_together_are_those_added_one_by_one(budget):
    loads = {str(seed): partial(noise, seed, side) for seed, side in enumerate([300, 100, 768] * 9)}
    together, single = ThumbnailStore(budget), ThumbnailStore(budget)
    together.add_all(loads)
    assert [together.number(key) for key in loads] == [
        single.add(key, load) for key, load in loads.items()
    ]
    assert together.encoded == single.encoded
    assert together.large == single.large
    assert together.n_left_out == single.n_left_out


def test_a_picture_that_cannot_be_read_has_no_number_and_the_others_have():
    def refuse():
        raise DataError("x.png: cannot be read")

    store = ThumbnailStore(10_000_000)
    store.add_all({"a": lambda: noise(0), "b": refuse, "c": lambda: noise(1)})
    assert [store.number(key) for key in "abc"] == [0, None, 1]
    assert store.n_left_out == 0


def test_pictures_beyond_the_room_are_not_loaded():
    loaded = []
    store = ThumbnailStore(1)
    store.add_all({str(at): lambda at=at: loaded.append(at) or noise(at) for at in range(500)})
    assert len(loaded) < 100
    assert store.n_left_out == 500
