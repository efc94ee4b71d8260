"""Draws `docs/contact_sheet.png`: three procedural rooms of each type, each from its most telling view.

python benchmarks/contact_sheet.py [OUT.png]
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from infthor_eval.sim.actions import bind
from infthor_eval.sim.scenes.catalogue import Catalogue
from infthor_eval.sim.simulation import Simulation

_ROOMS = ("kitchen", "living-room", "bedroom", "bathroom")
_SEEDS = (1, 2, 3)
_SIZE, _LINE = 300, 16


def do(sim: Simulation, action: str, **arguments: object) -> None:
    """Does one action."""
    found, checked = bind({"action": action, **arguments})
    found.run(sim, **checked)


def interest(sim: Simulation) -> float:
    """How much a view shows: objects by the logarithm of their pixels, so that many middling ones beat one large."""
    picture = sim.view()
    counts = np.bincount(picture.instances.ravel() + 1, minlength=len(picture.names) + 1)[1:]
    shown = [c for c, name in zip(counts, picture.names, strict=True) if "|" in name and c > 40]
    crowding = float((picture.depth < 0.7).mean())
    return sum(float(np.log(c)) for c in shown) * (1 - crowding)


def best_view(sim: Simulation, name: str) -> Image.Image:
    """The picture of the view with the most to see."""
    do(sim, "Reset", sceneName=name)
    do(sim, "Initialize", fieldOfView=75)
    views = []
    for x, z in sorted(sim.world.nav)[::3]:
        for yaw in (0.0, 90.0, 180.0, 270.0):
            do(sim, "Teleport", position={"x": x, "z": z}, rotation={"y": yaw}, horizon=20.0)
            views.append((interest(sim), x, z, yaw))
    _, x, z, yaw = max(views)
    do(sim, "Teleport", position={"x": x, "z": z}, rotation={"y": yaw}, horizon=20.0)
    do(sim, "ChangeQuality", quality="Ultra")
    return Image.fromarray(sim.colours(sim.agent_picture())[::-1])


def main() -> None:
    """Draws the sheet."""
    out = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/contact_sheet.png")
    sim = Simulation(Catalogue(), _SIZE, _SIZE)
    sheet = Image.new("RGB", (_SIZE * len(_ROOMS), (_SIZE + _LINE) * len(_SEEDS)), "white")
    draw = ImageDraw.Draw(sheet)
    for column, room in enumerate(_ROOMS):
        for row, seed in enumerate(_SEEDS):
            x, y = column * _SIZE, row * (_SIZE + _LINE)
            sheet.paste(best_view(sim, f"{room}-{seed}"), (x, y + _LINE))
            draw.text((x + 4, y + 2), f"{room}-{seed}", fill="black")
    sheet.save(out, optimize=True)


if __name__ == "__main__":
    main()
