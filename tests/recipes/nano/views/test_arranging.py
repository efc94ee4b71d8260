import math
import random

from hypothesis import given
from hypothesis import strategies as st

from recipes.nano.views.arranging import choose_pose
from tests.thor.views import thing, view

coordinates = st.integers(-8, 8).map(lambda steps: steps / 4)
POSITIONS = st.lists(st.tuples(coordinates, coordinates), min_size=1, max_size=6)


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
