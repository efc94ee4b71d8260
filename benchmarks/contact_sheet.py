"""Draw `docs/contact_sheet.png`: rooms, close-ups of shapes, and held objects.

It has three procedural rooms of each type, each from the view that shows most; then close-ups of
shapes that are easily confused; then frames in which the agent holds an object.

python benchmarks/contact_sheet.py [OUT.png]
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from infthor_sim.actions import bind
from infthor_sim.geometry import euler_matrix
from infthor_sim.objects import SimObject, default_object
from infthor_sim.pictures.views import Display
from infthor_sim.render.camera import PinholeCamera
from infthor_sim.render.lighting import Lights
from infthor_sim.render.picture import cast_picture, colour_picture, compiled_rasterizer
from infthor_sim.render.primitives import Form, Material, ShapePart, rows
from infthor_sim.render.shapes import shape
from infthor_sim.scenes.catalogue import Catalogue
from infthor_sim.simulation import Simulation

_ROOMS = ("kitchen", "living-room", "bedroom", "bathroom")
_SEEDS = (1, 2, 3)
_SIZE, _LINE = 300, 16
_NEAR = 150  # size of a close-up
_OPEN = {"Box", "Fridge", "Drawer", "Cabinet", "Microwave", "Safe"}
_SHAPES = ("Bowl", "AppleSliced", "BreadSliced", "TomatoSliced", "PotatoSliced", "LettuceSliced",
           "BaseballBat",
           "ButterKnife", "Knife", "Pencil", "Pen", "KeyChain", "Cloth", "Potato", "Pillow",
           "Bread", "Box", "Fridge",
           "Drawer", "Cabinet", "SinkBasin", "DiningTable", "SideTable", "CoffeeTable", "Desk",
           "Apple", "Tomato",
           "TennisRacket", "AlarmClock", "Watch", "Ladle", "Statue", "CreditCard", "CellPhone",
           "SaltShaker",
           "PepperShaker", "Microwave", "Safe", "DogBed", "Lettuce",
           "Egg", "ScrubBrush", "Plunger", "Newspaper", "Fork", "Spoon", "CD",
           "SoapBar")  # fmt: skip
_HELD = (
    ("kitchen-1", "Pan"),
    ("kitchen-2", "Bread"),
    ("bedroom-1", "BaseballBat"),
    ("living-room-1", "Box"),
)


def do(sim: Simulation, action: str, **arguments: object) -> None:
    """Execute one action."""
    method, checked = bind({"action": action, **arguments})
    method.run(sim, **checked)


def picture(sim: Simulation) -> Image.Image:
    """Return the agent's frame."""
    return Image.fromarray(np.ascontiguousarray(sim.views.colours(sim.views.agent_frame())[::-1]))


def interest(sim: Simulation) -> float:
    """Return how much a view shows: the sum of log pixels, by which several medium objects beat a
    large one."""
    seen = sim.views.agent_view()
    counts = np.bincount(seen.instances.ravel() + 1, minlength=len(seen.names) + 1)[1:]
    shown = [c for c, name in zip(counts, seen.names, strict=True) if "|" in name and c > 40]
    crowding = float((seen.depth < 0.7).mean())
    return sum(float(np.log(c)) for c in shown) * (1 - crowding)


def best_view(sim: Simulation, name: str) -> Image.Image:
    """Return the frame of the view that shows most."""
    do(sim, "Reset", sceneName=name)
    do(sim, "Initialize", fieldOfView=75)
    views = []
    for x, z in sorted(sim.world.nav)[::3]:
        for yaw in (0.0, 90.0, 180.0, 270.0):
            do(sim, "Teleport", position={"x": x, "z": z}, rotation={"y": yaw}, horizon=20.0)
            views.append((interest(sim), x, z, yaw))
    _, x, z, yaw = max(views)
    do(sim, "Teleport", position={"x": x, "z": z}, rotation={"y": yaw}, horizon=20.0)
    return picture(sim)


def close_up(object_type: str) -> Image.Image:
    """Return a picture of an object of the usual size on stone, from above and from its front
    side."""
    item: SimObject = default_object(object_type, np.zeros(3))
    item.state.openness = float(object_type in _OPEN)
    item.hinge = -1
    reach = float(np.linalg.norm(item.box_size)) * (1.4 if item.state.openness else 1.0)
    ground = ShapePart(Form.BOX, (0, -0.02, 0), (30, 0.02, 30), (0.62, 0.6, 0.56), Material.STONE)
    under = np.array([0.0, float(item.bounds()[0][1]), 0.0])
    prims = np.concatenate(
        [rows([ground], under, np.eye(3), 0), rows(shape(item), item.position, item.matrix, 1)]
    )
    view = euler_matrix((34.0, 205.0, 0.0))
    camera = PinholeCamera(item.center - view[:, 2] * reach * 2.5, view, 28.0, _NEAR, _NEAR)
    rasterizer = compiled_rasterizer()
    seen = cast_picture(prims, ("ground", object_type), camera, rasterizer)
    return Image.fromarray(
        np.ascontiguousarray(colour_picture(seen, Lights.none(), rasterizer)[::-1])
    )


def in_hand(sim: Simulation, name: str, object_type: str) -> Image.Image:
    """Return the frame of the view that shows most, with an object in the hand."""
    best_view(sim, name)
    do(sim, "Initialize", fieldOfView=60)
    item = next(o for o in sim.world.objects.values() if o.object_type == object_type)
    do(sim, "PickupObject", objectId=item.object_id, forceAction=True)
    return picture(sim)


def main() -> None:
    """Draw the sheet."""
    out = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/contact_sheet.png")
    sim = Simulation(Catalogue(), Display(_SIZE, _SIZE))
    tiles = [
        (f"{room}-{seed}", best_view(sim, f"{room}-{seed}")) for seed in _SEEDS for room in _ROOMS
    ]  # fmt: skip
    tiles += [(object_type, close_up(object_type)) for object_type in _SHAPES]
    tiles += [
        (f"{name}, {object_type} in hand", in_hand(sim, name, object_type))
        for name, object_type in _HELD
    ]
    lay(tiles).quantize(256, dither=Image.Dither.NONE).save(out, optimize=True)


def lay(tiles: list[tuple[str, Image.Image]]) -> Image.Image:
    """Return the sheet of the named pictures, in lines as wide as four rooms."""
    places, x, y = [], 0, 0
    for _, tile in tiles:
        places.append((x, y))
        x += tile.width
        if x >= _SIZE * len(_ROOMS):
            x, y = 0, y + tile.height + _LINE
    sheet = Image.new("RGB", (_SIZE * len(_ROOMS), y), "white")
    draw = ImageDraw.Draw(sheet)
    for (name, tile), (left, top) in zip(tiles, places, strict=True):
        sheet.paste(tile, (left, top + _LINE))
        draw.text((left + 4, top + 2), name, fill="black")
    return sheet


if __name__ == "__main__":
    main()
