"""The shapes of objects: within their boxes, one outside open or closed, floors for contents."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from infthor_sim.geometry import Array, euler_matrix
from infthor_sim.object_types import OBJECT_TYPES
from infthor_sim.objects import DRAWER_SLIDE, SimObject, SimObjectState, default_object
from infthor_sim.physics.receptacles import surfaces
from infthor_sim.physics.solids import as_open
from infthor_sim.render.camera import PinholeCamera
from infthor_sim.render.lighting import Lights
from infthor_sim.render.picture import cast_picture, colour_picture
from infthor_sim.render.primitives import Form, ShapePart, rows
from infthor_sim.render.shapes import shape

from .numpy_renderer import NUMPY

_OUT = 0.02  # metres that handles and the like may stand out
_STYLES = 12
# What lies in a bowl rests on its sides; a pan's box has its handle, so that its middle is not the
# pan's.
_UNEVEN = {"Bowl", "Pan"}


def states(item: SimObject) -> Iterator[SimObjectState]:
    """Yield the states that change how an object of a type looks."""
    yield SimObjectState()
    declared = item.type
    if declared.openable:
        yield SimObjectState(openness=1.0)
    if declared.toggleable:
        yield SimObjectState(toggled=True)
    if declared.breakable:
        yield SimObjectState(broken=True)
    if declared.usable_up:
        yield SimObjectState(used_up=True)
    if declared.fillable:
        yield SimObjectState(fill_liquid="water")
    yield SimObjectState(cooked=True, dirty=True)


def reach(part: ShapePart) -> Array:
    """Return the half extents of a primitive along the object's axes, metres (3,)."""
    matrix = np.eye(3) if part.matrix is None else part.matrix
    extents = np.abs(matrix * np.asarray(part.half))
    if part.form == Form.BOX:
        return extents.sum(axis=1)
    if part.form in (Form.CYLINDER, Form.CUP):
        return extents[:, 1] + np.hypot(extents[:, 0], extents[:, 2]) * max(part.bottom, part.top)
    return np.asarray(np.linalg.norm(extents, axis=1))


def allowed(item: SimObject) -> tuple[Array, Array]:
    """Return the corners of the box that an object may fill, with the way of its door or drawer."""
    low, high = (
        item.box_center - item.box_size / 2 - _OUT,
        item.box_center + item.box_size / 2 + _OUT,
    )
    if item.type.hinged and item.state.openness:
        high[2] += item.box_size[0]
        low[0] -= 0.1  # a door swings 85 degrees about its edge, its grip and thickness beyond it
        high[0] += 0.1
    if item.type.runs_water and item.state.toggled:
        low[1] -= 0.05  # the water falls into the basin
    if item.box_size[1] < item.type.space_below:
        low[1] -= 0.04  # a recorded counter's box is the space above its slab
    if item.type.slides:
        high[2] += DRAWER_SLIDE * item.box_size[2] * item.state.openness
    return low, high


@pytest.mark.parametrize("object_type", sorted(OBJECT_TYPES))
def test_shape_stays_in_its_box(object_type):
    item = default_object(object_type, np.zeros(3))
    item.hinge = -1
    for state in states(item):
        for style in range(_STYLES):
            seen = replace(item, state=state, style=style)
            low, high = allowed(seen)
            for part in shape(seen):
                middle = np.asarray(part.center)
                out = max((low - middle + reach(part)).max(), (middle + reach(part) - high).max())
                assert out <= 1e-9, (
                    f"{part} of style {style} is {out + _OUT:.3f} m out of the box, {state}"
                )


def looks(item: SimObject, pitch: float, yaw: float) -> tuple[Array, Array]:
    """Return the picture (60, 60, 3) of an object from a direction, and where it shows (60, 60)."""
    view = euler_matrix((pitch, yaw, 0.0))
    away = 3.0 * float(np.linalg.norm(item.box_size))
    camera = PinholeCamera(item.center - view[:, 2] * away, view, 30.0, 60, 60)
    seen = cast_picture(
        rows(shape(item), item.position, item.matrix, 0), (item.object_id,), camera, NUMPY
    )
    return colour_picture(seen, Lights.none(), NUMPY, antialias=False).astype(
        float
    ), seen.instances == 0


@pytest.mark.parametrize("object_type", sorted(t.name for t in OBJECT_TYPES.values() if t.hinged))
@pytest.mark.parametrize("style", range(4))
def test_outside_looks_the_same_open_and_closed(object_type, style):
    item = default_object(object_type, np.zeros(3))
    item.hinge, item.style = -1, style
    opened = as_open(item, 1.0)
    # from above and behind
    for pitch, yaw in ((80.0, 0.0), (20.0, 0.0), (20.0, 40.0), (20.0, -40.0)):
        closed_look, closed_at = looks(item, pitch, yaw)
        open_look, open_at = looks(opened, pitch, yaw)
        both = closed_at & open_at
        both[:, [0, -1]] = False
        assert both.sum() > 100
        np.testing.assert_allclose(
            open_look[both].mean(axis=0), closed_look[both].mean(axis=0), atol=4.0
        )


@pytest.mark.parametrize("object_type", sorted(
    t.name for t in OBJECT_TYPES.values() if (t.levels or t.open_top) and t.name not in _UNEVEN
))  # fmt: skip
@given(share_x=st.floats(-0.55, 0.55), share_z=st.floats(-0.55, 0.55), grown=st.floats(0.8, 1.5))
@settings(max_examples=10, deadline=None)
def test_contents_stand_on_what_is_drawn(object_type, share_x, share_z, grown):
    """Where contents stand is a drawn floor, at most a few millimetres above or below."""
    usual = default_object(object_type, np.zeros(3)).box_size
    item = default_object(object_type, np.zeros(3), size=usual * grown)
    item.hinge = -1
    item = as_open(item, 1.0) if item.type.openable else item
    parts = [(p.center, reach(p)) for p in shape(item) if p.form in (Form.BOX, Form.CYLINDER)]
    if object_type == "Fridge":
        share_z = min(share_z, 0.2)  # in front its shelves are frames, seen through as clear glass
    for surface in surfaces(item):
        place = surface.center + np.array(
            [share_x * surface.half[0] * 0.8, 0.0, share_z * surface.half[1] * 0.8]
        )
        place -= item.position
        tops = [
            float(at[1] + out[1]) for at, out in parts
            if (np.abs(place - at)[[0, 2]] <= out[[0,
                                                   2]]).all() and at[1] - out[1] <= place[1] + 0.003
        ]  # fmt: skip
        assert tops and abs(max(tops) - place[1]) < 0.006, (
            f"{max(tops, default=None)} under {place[1]}"
        )


def test_a_drawer_holds_what_may_lie_in_it():
    """No wall of an open drawer reaches over the area in which its contents are put."""
    item = as_open(default_object("Drawer", np.zeros(3)), 1.0)
    (inside,) = surfaces(item)
    middle = inside.center - item.position
    for part in shape(item):
        at, out = np.asarray(part.center), reach(part)
        if at[1] + out[1] > middle[1] + 0.004:
            over = (
                np.abs(at - middle)[[0, 2]] < np.asarray(inside.half) + out[[0, 2]] - 1e-9
            ).all()
            assert not over, f"{part} stands where contents lie"
    tallest = max(float(np.asarray(p.center)[1] + reach(p)[1]) for p in shape(item))
    sides = [
        p for p in shape(item) if reach(p)[2] > 0.1 and reach(p)[0] < 0.02 and reach(p)[1] > 0.03
    ]
    assert len(sides) == 2
    assert all(float(np.asarray(p.center)[1] + reach(p)[1]) > 0.9 * tallest for p in sides)


@pytest.mark.parametrize("object_type", ["CD", "KeyChain", "SoapBar"])
def test_things_of_one_model_are_drawn_apart(object_type):
    """Ten objects of one style have at least four looks, always the same by their ids."""
    looks_by_id = []
    for _ in range(2):
        items = [default_object(object_type, np.array([0.1 * n, 1.0, 0.0])) for n in range(10)]
        for item in items:
            item.style = 0
        looks_by_id.append([tuple(part.color for part in shape(item)) for item in items])
    assert len(set(looks_by_id[0])) >= 4
    assert looks_by_id[0] == looks_by_id[1]
