import pytest

from infthor_eval.household.possible_tasks import usual_tasks
from infthor_eval.household.tasks import SAMPLED
from infthor_eval.scene_types import scene_type


@pytest.mark.parametrize(
    ("scene", "expected"),
    [
        ("kitchen-3", "Kitchen"),
        ("living-room-12", "LivingRoom"),
        ("FloorPlan1", "Kitchen"),
        ("FloorPlan230", "LivingRoom"),
        ("FloorPlan301", "Bedroom"),
        ("FloorPlan430", "Bathroom"),
        ("FloorPlan31", None),
        ("FloorPlan_Train1_1", None),
        ("house-1", None),
    ],
)
def test_scenes_by_name(scene, expected):
    assert scene_type(scene) == expected


def test_all_is_done_in_a_house():
    assert usual_tasks("house-2") == set(SAMPLED)


# `GOALS_VALID` of the published generator (July 2026), by kind of room
@pytest.mark.parametrize(
    ("scene", "goals"),
    [
        ("kitchen-1", "simple two clean heat cool movable"),
        ("living-room-1", "simple two light movable"),
        ("bedroom-1", "simple two light movable"),
        ("FloorPlan301", "simple two light movable"),
        ("bathroom-1", "simple two clean"),
    ],
)
def test_the_goals_of_each_kind_of_room_are_the_published_ones(scene, goals):
    names = {
        "simple": "pick_and_place_simple",
        "two": "pick_two_obj_and_place",
        "light": "look_at_obj_in_light",
        "clean": "pick_clean_then_place_in_recep",
        "heat": "pick_heat_then_place_in_recep",
        "cool": "pick_cool_then_place_in_recep",
        "movable": "pick_and_place_with_movable_recep",
    }
    assert usual_tasks(scene) == {names[goal] for goal in goals.split()}
