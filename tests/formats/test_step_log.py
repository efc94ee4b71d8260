import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.errors import DataError
from infthor_eval.formats.step_log import (
    LoggedPose,
    ObjectInFrame,
    ObjectLog,
    ObjectState,
    Step,
    iter_object_states,
    read_steps,
    write_steps,
)

PUBLISHED = {
    "img_idx": 2,
    "img_filename": "000000002.png",
    "step": 1,
    "object_log": {
        "visible": ["Vase"],
        "pickupable": ["Vase"],
        "isOpen": [],
        "inven_obj": [],
        "receptacles": ["Shelf"],
        "recep_objs": {"Shelf": ["Vase"]},
    },
}


def put(folder, document):
    (folder / "metadata.json").write_text(
        document if isinstance(document, str) else json.dumps(document)
    )
    return folder


def test_published_layouts_read_alike(tmp_path):
    columns = {key: [value, value] for key, value in PUBLISHED.items()}
    single = read_steps(put(tmp_path, PUBLISHED))
    assert single == read_steps(put(tmp_path, [PUBLISHED]))
    assert single == read_steps(put(tmp_path, columns))[:1]
    assert single[0].object_log.recep_objs == {"Shelf": ["Vase"]}
    assert single[0].seen is None


def test_columns_with_img_idx_alone(tmp_path):
    steps = read_steps(put(tmp_path, {"img_idx": [0, 1, 2]}))
    assert [step.img_filename for step in steps] == [f"{number:09d}.png" for number in range(3)]


@pytest.mark.parametrize(
    ("document", "place"),
    [
        ("{", "not valid JSON"),
        ("3", "neither a list"),
        ({"img_idx": [0, 1], "step": [0]}, "column 'step' has 1 entries"),
        ([PUBLISHED, {"img_idx": "x", "img_filename": "a"}], "entry 1"),
        ([7], "entry 0"),
    ],
)
def test_malformed_logs_name_the_place(tmp_path, document, place):
    with pytest.raises(DataError, match=place) as caught:
        read_steps(put(tmp_path, document))
    assert "\n" not in str(caught.value)
    assert str(tmp_path) in str(caught.value)


def test_missing_log(tmp_path):
    with pytest.raises(DataError, match="cannot be read"):
        read_steps(tmp_path)


states = st.builds(
    ObjectState,
    type=st.sampled_from(["Mug", "Fridge"]),
    parents=st.lists(st.text(max_size=5), max_size=2).map(tuple),
    is_open=st.sampled_from([None, True, False]),
    held=st.booleans(),
)
logged = st.builds(
    Step,
    img_idx=st.integers(0, 9999),
    img_filename=st.text(max_size=20),
    object_log=st.builds(ObjectLog, visible=st.lists(st.text(max_size=8), max_size=3)),
    action=st.none() | st.text(max_size=10),
    pose=st.none() | st.just(LoggedPose(0.25, 0.9, -1.0, 90.0, 30.0)),
    seen=st.none()
    | st.dictionaries(
        st.text(max_size=5), st.just(ObjectInFrame(12, (0, 0, 3, 4), True)), max_size=2
    ),
    changes=st.dictionaries(st.text(max_size=5), states, max_size=3),
)


@given(steps=st.lists(logged, max_size=4))
def test_what_is_written_is_read(tmp_path_factory, steps):
    folder = tmp_path_factory.mktemp("log")
    write_steps(folder, steps)
    assert read_steps(folder) == steps


def test_worlds_apply_changes_in_order():
    shut, wide = (ObjectState("Fridge", is_open=is_open) for is_open in (False, True))
    first = Step(0, "0.png", changes={"a": ObjectState("Mug"), "b": shut})
    steps = [first, Step(1, "1.png", changes={"b": wide})]
    opened = [dict(world)["b"].is_open for world in iter_object_states(steps)]
    assert opened == [False, True]
