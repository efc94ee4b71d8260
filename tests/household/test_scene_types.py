import pytest

from infthor_eval.household.scene_types import scene_type, usual_tasks
from infthor_eval.household.tasks import SAMPLED, TaskType


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


def test_what_is_done_where():
    assert TaskType.HEAT in usual_tasks("kitchen-1") and TaskType.EXAMINE not in usual_tasks(
        "kitchen-1"
    )
    assert usual_tasks("FloorPlan301") >= {TaskType.EXAMINE, TaskType.STACK}
    assert usual_tasks("bathroom-1") == {TaskType.PLACE, TaskType.PLACE_TWO, TaskType.CLEAN}
    assert usual_tasks("house-2") == set(SAMPLED)
