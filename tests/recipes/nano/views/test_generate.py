import math
import random

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.segmentation import Segmentation
from infthor_eval.workers import WorkerSettings
from recipes.nano.views.generate import ViewJob, cell_pixels, choose_pose, generate_views
from recipes.nano.views.labelled_views import read_views
from tests.thor.views import thing, view

coordinates = st.integers(-8, 8).map(lambda steps: steps / 4)
POSITIONS = st.lists(st.tuples(coordinates, coordinates), min_size=1, max_size=6)
JOB = ViewJob("kitchen-301", seed=3, arrangements=2, per_arrangement=4, side=56, grid=4)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("views")


@pytest.fixture(scope="module")
def generated(folder):
    return generate_views([JOB], embedded_launch(), folder, WorkerSettings())


def test_a_room_has_the_views_that_were_asked_for(generated):
    assert (generated.views, generated.failures) == (8, [])
    views = read_views(generated.paths[0])
    assert views.frames.shape == (8, 56, 56, 3)
    assert len({frame.tobytes() for frame in views.frames}) == 8


def test_labels_are_of_the_frames(generated):
    views = read_views(generated.paths[0])
    assert set(views.view.tolist()) == set(range(8))
    # cells of a frame of 300 pixels have 75 x 75, and what they show is at most that
    per_cell = np.zeros((8, 4, 4), int)
    np.add.at(per_cell, views.view, views.pixels)
    assert 0 < per_cell.max() <= 75 * 75
    # what is held stays in the hand for all views of an arrangement, below the middle of the frame
    held = views.view[views.held]
    assert set(held.tolist()) in ({0, 1, 2, 3}, {4, 5, 6, 7}, set(range(8)))
    assert not views.pixels[views.held][:, :2].any()


def test_things_are_elsewhere_in_each_arrangement(generated):
    views = read_views(generated.paths[0])
    in_receptacles = [
        {
            (views.names[kind], views.names[place])
            for view, kind, place in zip(views.view, views.type, views.receptacle, strict=True)
            if view // 4 == number and place >= 0
        }
        for number in range(2)
    ]
    assert in_receptacles[0] != in_receptacles[1]


def test_a_second_run_finds_what_the_first_one_made(folder, generated):
    before = generated.paths[0].read_bytes()
    told = []
    again = generate_views([JOB], embedded_launch(), folder, WorkerSettings(), told.append)
    assert (again.paths, again.views, told) == (generated.paths, 8, [True])
    assert again.paths[0].read_bytes() == before


def test_the_same_seed_gives_the_same_views(generated, tmp_path):
    again = generate_views([JOB], embedded_launch(), tmp_path, WorkerSettings())
    for name, array in vars(read_views(again.paths[0])).items():
        assert np.array_equal(array, getattr(read_views(generated.paths[0]), name)), name


def test_a_room_that_cannot_be_loaded_does_not_stop_the_others(tmp_path):
    jobs = [JOB._replace(scene="no-such-room-1"), JOB._replace(arrangements=1, per_arrangement=1)]
    generated = generate_views(jobs, embedded_launch(), tmp_path, WorkerSettings())
    assert generated.views == 1
    assert len(generated.failures) == 1
    assert "no-such-room-1" in generated.failures[0]


@given(
    hnp.arrays(
        np.uint32, hnp.array_shapes(min_dims=2, max_dims=2, max_side=12), elements=st.integers(0, 3)
    ),
    st.integers(1, 5),
)
def test_pixels_of_cells_are_those_of_the_named_codes_in_them(codes, grid):
    names = {0: "Mug|0", 2: "Bowl|1", 9: "Cup|2"}
    height, width = codes.shape
    expected = {
        name: [
            [
                sum(
                    codes[y, x] == code
                    for y in range(height)
                    for x in range(width)
                    if (y * grid // height, x * grid // width) == (row, column)
                )
                for column in range(grid)
            ]
            for row in range(grid)
        ]
        for code, name in names.items()
        if code in codes
    }
    colors = [{"name": name, "color": (0, 0, code)} for code, name in names.items()]
    frame = np.stack([np.zeros_like(codes), np.zeros_like(codes), codes], axis=-1)
    cells = cell_pixels(Segmentation(frame, msgspec.Raw(msgspec.msgpack.encode(colors))), grid)
    assert {name: counts.tolist() for name, counts in cells.items()} == expected


@given(POSITIONS, st.integers(0, 999))
def test_poses_are_where_the_agent_can_stand_and_look(positions, seed):
    room = view(thing("Mug|+01.00|+00.90|+00.50", pickupable=True))
    pose = choose_pose(room, positions, random.Random(seed))
    assert (pose.position.x, pose.position.z) in positions
    assert pose.position.y == room.agent.position.y
    assert 0 <= pose.rotation < 360
    assert pose.horizon in (-30, 0, 30, 60)


def test_most_poses_have_the_thing_in_view():
    room = view(thing("Mug|+01.00|+00.90|+00.50", pickupable=True))
    positions = [(x / 4, z / 4) for x in range(-8, 9) for z in range(-8, 9)]
    rng = random.Random(0)
    poses = [choose_pose(room, positions, rng) for _ in range(200)]

    def is_before(pose):
        angle = math.degrees(math.atan2(1.0 - pose.position.x, 0.5 - pose.position.z))
        return abs((angle - pose.rotation + 180) % 360 - 180) <= 45

    assert sum(map(is_before, poses)) > 160


def test_an_empty_room_is_looked_at_all_the_same():
    pose = choose_pose(view(), [(0.5, 0.25)], random.Random(0))
    assert (pose.position.x, pose.position.z) == (0.5, 0.25)
