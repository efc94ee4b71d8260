"""The renderer: exact depth and ids, both implementations equal, lights, the held object."""

import numpy as np
import pytest

from infthor_sim.geometry import euler_matrix
from infthor_sim.object_types import OBJECT_TYPES
from infthor_sim.objects import default_object
from infthor_sim.pictures.instances import instance_color
from infthor_sim.player.fifo import FieldType
from infthor_sim.render.camera import PinholeCamera
from infthor_sim.render.hand import HAND
from infthor_sim.render.lighting import Lights
from infthor_sim.render.picture import (
    cast_picture,
    colour_picture,
    compiled_rasterizer,
    digest_of_colours,
)
from infthor_sim.render.primitives import Form, Material, ShapePart, rows
from infthor_sim.render.shapes import shape

from .harness import Bench
from .numpy_renderer import NUMPY

COMPILED = compiled_rasterizer()
RASTERIZERS = pytest.mark.parametrize("rasterizer", [COMPILED, NUMPY], ids=["numba", "numpy"])
STRAIGHT = np.eye(3)


def camera(size: int = 101, **more: float) -> PinholeCamera:
    return PinholeCamera(np.zeros(3), STRAIGHT, 60.0, size, size, **more)


def one(form: Form, distance: float, half: float = 0.5, **more: float) -> np.ndarray:
    part = ShapePart(form, (0, 0, 0), (half,) * 3, (0.5, 0.5, 0.5), **more)
    return rows([part], np.array([0.0, 0.0, distance]), STRAIGHT, 0)


@RASTERIZERS
@pytest.mark.parametrize("form", [Form.BOX, Form.ELLIPSOID, Form.CYLINDER, Form.CUP])
def test_depth_is_that_of_geometry(rasterizer, form):
    picture = cast_picture(one(form, 3.0), ("a",), camera(), rasterizer)
    assert picture.depth[50, 50] == pytest.approx(2.5, abs=1e-3)
    assert (picture.instances[50, 50], picture.instances[0, 0]) == (0, -1)
    wide = np.nonzero((picture.instances == 0).any(axis=0))[0]
    focal = 50.5 / np.tan(np.radians(30))
    expected = 2 * focal * (0.5 / 2.5 if form == Form.BOX else 0.5 / np.sqrt(9 - 0.25))
    assert len(wide) == pytest.approx(expected, abs=1.5)


@RASTERIZERS
def test_a_cup_shows_its_inside_from_above(rasterizer):
    above = PinholeCamera(np.array([0.0, 2.0, 0.0]), euler_matrix((90, 0, 0)), 60.0, 101, 101)
    for form, depth in ((Form.CYLINDER, 1.5), (Form.CUP, 2.5), (Form.BOWL, 2.5)):
        drawn = rows([ShapePart(form, (0, 0, 0), (0.5,) * 3, (1, 1, 1))], np.zeros(3), STRAIGHT, 0)
        picture = cast_picture(drawn, ("a",), above, rasterizer)
        assert picture.depth[50, 50] == pytest.approx(depth, abs=1e-3)


def test_both_renderers_draw_the_same_picture():
    random = np.random.default_rng(3)
    parts = [
        rows(
            [ShapePart(Form(i % len(Form)), (0, 0, 0), random.uniform(0.03, 0.3, 3),
                       tuple(random.uniform(0.2, 1, 3)),
                  Material(i % len(Material)), bottom=0.6, emission=0.5 * (i % 7 == 0))],
            random.uniform((-1.5, -1.5, 0.5), (1.5, 1.5, 3.5)),
            euler_matrix(random.uniform(0, 360, 3)), i,
        ) for i in range(120)
    ]  # fmt: skip
    prims, names = np.concatenate(parts), tuple(map(str, range(120)))
    lights = Lights(np.array([[0.3, 1.0, 1.0, 0.9]]), 0.7)
    pictures = []
    for rasterizer in (COMPILED, NUMPY):
        picture = cast_picture(prims, names, camera(120), rasterizer)
        pictures.append(
            (
                picture.depth, picture.instances, colour_picture(picture, lights, rasterizer),
                rasterizer.count(picture.nearest, len(picture.projection.index)),
            )
        )  # fmt: skip
    for first, second in zip(*pictures, strict=True):
        assert np.array_equal(first, second)


def test_near_plane_and_things_behind_are_cut():
    assert not len(COMPILED.project(one(Form.BOX, -3.0), camera()).index)
    assert cast_picture(one(Form.BOX, 0.0, 0.05), ("a",), camera(), COMPILED).instances.max() == -1


# closed; the space above a board; one of the panes that its box is around
FLAT = {"Laptop", "Shelf", "ShowerGlass"}


@pytest.mark.parametrize("object_type", sorted(OBJECT_TYPES))
def test_shapes_fill_their_boxes_and_no_more(object_type):
    item = default_object(object_type, np.zeros(3))
    parts = shape(item)
    assert parts
    points = np.concatenate([_corners(part) for part in parts]) - item.box_center
    span = np.ptp(points, axis=0)
    loose = 0.035 + 0.25 * item.box_size
    assert np.all(np.abs(points) <= item.box_size / 2 + loose), "the shape sticks out of its box"
    if object_type not in FLAT:
        assert np.all(span >= 0.3 * item.box_size - 0.02), "the shape leaves most of its box empty"


def _corners(part: ShapePart) -> np.ndarray:
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    matrix = STRAIGHT if part.matrix is None else part.matrix
    return np.asarray(part.center) + (signs * np.asarray(part.half)) @ matrix.T


@pytest.mark.parametrize(
    ("object_type", "change"),
    [
        ("Fridge", {"openness": 1.0}), ("DeskLamp", {"toggled": True}),
        ("Mug", {"fill_liquid": "coffee"}),
        ("Plate", {"dirty": True}), ("Potato", {"cooked": True}), ("Drawer", {"openness": 0.5}),
        ("Television", {"toggled": True}), ("Microwave", {"toggled": True}),
        ("StoveBurner", {"toggled": True}),
        ("Vase", {"broken": True}),
    ],
)  # fmt: skip
def test_a_state_can_be_seen(object_type, change):
    item = default_object(object_type, np.zeros(3))
    before = repr(shape(item))
    for name, value in change.items():
        setattr(item.state, name, value)
    assert repr(shape(item)) != before


def test_ids_frame_names_every_object_by_its_colour():
    bench = Bench.at(
        "kitchen-1", renderInstanceSegmentation=True, renderSemanticSegmentation=True, size=120
    )
    bench.ok("RotateRight")
    pixels = np.frombuffer(bench.frames[FieldType.IDS], dtype=np.uint8).reshape(-1, 4)
    assert (pixels[:, 3] == 255).all()
    known = {tuple(c["color"]) for c in bench.metadata["colors"]}
    assert set(map(tuple, np.unique(pixels[:, :3], axis=0).tolist())) <= known
    assert len(known) == len(bench.metadata["colors"]), "two names share a colour"
    assert instance_color("Mug|1") == instance_color("Mug|1")
    assert len(bench.frames[FieldType.CLASSES]) == 120 * 120 * 4


def test_smoothing_changes_colours_only():
    bench = Bench.at(
        "living-room-1", renderInstanceSegmentation=True, renderDepthImage=True, size=100
    )
    fine = bench.frames
    bench.ok("ChangeQuality", quality="Low")
    plain = bench.frames
    assert plain[FieldType.IDS] == fine[FieldType.IDS]
    assert plain[FieldType.DEPTH] == fine[FieldType.DEPTH]
    jagged, smooth = (
        np.frombuffer(frames[FieldType.RGB], dtype=np.uint8).astype(int) for frames in (plain, fine)
    )
    assert 0 < np.abs(jagged - smooth).mean() < 12
    bench.reset("living-room-1", renderInstanceSegmentation=True)
    assert bench.frames[FieldType.RGB] == plain[FieldType.RGB], (
        "the quality stays over a Reset, as Unity's does"
    )
    bench.ok("ChangeQuality", quality="Ultra")
    assert bench.frames[FieldType.RGB] == fine[FieldType.RGB]


@RASTERIZERS
def test_a_smooth_edge_is_between_what_it_divides(rasterizer):
    tilted = [
        ShapePart(
            Form.BOX, (0, 0, 0), (0.5, 0.5, 0.1), (0.9, 0.1, 0.1), matrix=euler_matrix((0, 0, 20))
        )
    ]
    behind = [ShapePart(Form.BOX, (0, 0, 1), (9, 9, 0.1), (0.1, 0.1, 0.9))]
    straight = np.array([0.0, 0.0, 2.0])
    prims = np.concatenate(
        [rows(tilted, straight, STRAIGHT, 0), rows(behind, straight, STRAIGHT, 1)]
    )
    picture = cast_picture(prims, ("a", "b"), camera(), rasterizer)
    smooth = colour_picture(picture, Lights.none(), rasterizer)[:, :, 0].astype(int)
    sharp = colour_picture(picture, Lights.none(), rasterizer, antialias=False)[:, :, 0].astype(int)
    changed = smooth != sharp
    assert 40 < changed.sum() < 500
    assert smooth.min() >= sharp.min()
    assert smooth.max() <= sharp.max()
    assert len(np.unique(smooth[changed])) > 3


def test_a_held_object_floats_in_the_lower_middle():
    bench = Bench.at("kitchen-1", renderInstanceSegmentation=True, size=200)
    mug = bench.first("Mug")
    bench.force("PickupObject", mug)
    rows_, columns = np.nonzero(bench.shows(mug))
    assert 70 < columns.mean() < 130
    assert rows_.mean() > 120
    assert len(rows_) > 300


@pytest.mark.parametrize(
    ("scene", "object_type"),
    [("kitchen-1", "Mug"), ("kitchen-1", "Knife"), ("bedroom-1", "Pillow")],
)
def test_a_gripper_at_the_lower_edge_holds_what_is_held(scene, object_type):
    bench = Bench.at(scene, renderInstanceSegmentation=True, size=150)
    assert not bench.shows(HAND).any()
    held = bench.first(object_type)
    bench.force("PickupObject", held)
    hand, load = bench.shows(HAND), bench.shows(held)
    assert 0.001 < hand.mean() < 0.02
    assert hand[-1].any(), "it comes from the lower edge"
    columns, held_columns = np.nonzero(hand)[1], np.nonzero(load)[1]
    assert columns.min() - 3 <= held_columns.mean() <= columns.max() + 3
    assert np.nonzero(load)[0].min() < np.nonzero(hand)[0].min(), "what is held stands out above it"
    assert HAND in {entry["name"] for entry in bench.metadata["colors"]}


@pytest.mark.parametrize(
    ("scene", "object_type"), [("living-room-1", "Box"), ("bedroom-1", "Pillow")]
)
def test_what_the_hand_holds_hides_little_of_the_room(scene, object_type):
    bench = Bench.at(scene, renderInstanceSegmentation=True, size=150)
    held = bench.first(object_type)
    bench.force("PickupObject", held)
    before = bench.object(held)["position"]
    for horizon in (0.0, 30.0, 60.0):
        here = bench.metadata["agent"]["position"]
        bench.teleport(here["x"], here["z"], 90.0, horizon)
        mask = bench.shows(held)
        assert 0.005 < mask.mean() < 0.1
        assert not mask[:75].any(), "it stays in the lower half"
    assert bench.object(held)["position"] != before, (
        "the metadata tells where the hand is, not where it is drawn"
    )


def test_lamps_and_switches_light_the_room():
    bench = Bench.at("bedroom-1", size=80)

    def brightness() -> float:
        return float(bench.picture(FieldType.RGB).mean())

    lamp, switch = bench.first("DeskLamp"), bench.first("LightSwitch")
    bench.stand_before(lamp)
    dark = brightness()
    bench.force("ToggleObjectOn", lamp)
    assert brightness() > dark + 0.5
    bench.force("ToggleObjectOff", lamp)
    bench.force("ToggleObjectOff", switch)
    assert brightness() < dark - 5


def test_kernels_are_recompiled_when_a_source_changes(tmp_path):
    from infthor_sim.render import picture

    for name in picture._SOURCES:
        (tmp_path / name).write_text("a = 1", encoding="ascii")
    picture.drop_stale_kernels(tmp_path)
    compiled = tmp_path / "__pycache__" / "shading_numba._shade-1.py311.1.nbc"
    compiled.write_text("", encoding="ascii")
    assert not picture.drop_stale_kernels(tmp_path)
    (tmp_path / "patterns.py").write_text("a = 2", encoding="ascii")
    assert picture.drop_stale_kernels(tmp_path)
    assert not compiled.exists()


def test_pictures_of_one_digest_are_equal_and_those_of_another_are_drawn_as_such():
    """Of a walk with openings, with a held thing, and of the same walk once more after a change."""
    bench = Bench.at("kitchen-3", renderInstanceSegmentation=True)
    drawn: dict[str, bytes] = {}
    digests = []
    objects = bench.metadata["objects"]
    fridge, egg = (
        next(o["objectId"] for o in objects if o["objectType"] == name)
        for name in ("Fridge", "Egg")
    )
    for change in ("Pass", "OpenObject"):
        bench.force(change, fridge) if change != "Pass" else bench.ok("Pass")
        walked = []
        for _ in range(12):
            for name in ("RotateRight", "LookDown", "LookUp"):
                bench.step(name, imageDigest=True, renderImage=False)
                assert FieldType.RGB not in bench.frames
                digest = bench.metadata["imageDigest"]
                bench.step("Pass", imageDigest=True)
                assert bench.metadata["imageDigest"] == digest
                frame = bench.frames[FieldType.RGB]
                assert drawn.setdefault(digest, frame) == frame
                walked.append(digest)
        digests.append(walked)
        assert len(set(walked)) > 4
    assert set(digests[0]) != set(digests[1])
    assert set(digests[0]) & set(digests[1])  # where the fridge is not in view
    assert len(set(drawn.values())) == len(drawn)
    before = bench.metadata["imageDigest"]
    bench.force("PickupObject", egg)
    bench.step("Pass", imageDigest=True)
    assert bench.metadata["imageDigest"] != before
    assert drawn.get(bench.metadata["imageDigest"]) is None
    bench.ok("Pass")
    assert "imageDigest" not in bench.metadata


def test_the_light_is_part_of_a_digest():
    picture = cast_picture(one(Form.BOX, 3.0), ("a",), camera(), COMPILED)
    renamed = cast_picture(one(Form.BOX, 3.0), ("b",), camera(), COMPILED)
    lights = [Lights(np.zeros((0, 4)), 1.0), Lights(np.array([[0.0, 2.0, 1.0, 0.5]]), 1.0)]
    dark = Lights(np.zeros((0, 4)), 0.5)
    digests = [digest_of_colours(picture, light, COMPILED) for light in (*lights, dark)]
    assert len(set(digests)) == 3
    assert digest_of_colours(renamed, lights[0], COMPILED) == digests[0]
    assert digest_of_colours(picture, lights[0], COMPILED, antialias=False) not in digests
