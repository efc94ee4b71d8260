"""Check by eye what the drawings of objects look like: random views to be named blind.

python benchmarks/object_views.py draw OUT --types Fork,Spoon [--views 10] [--pixels 70 115]
python benchmarks/object_views.py score OUT GUESSES

`draw` puts objects on the furniture of procedural rooms (furniture and towels stay where rooms have
them), looks at each from a random cell from which it fills as many pixels of the 300 x 300 frame,
and writes sheets of the shuffled views, each marked and enlarged four times, and a key. GUESSES has
a line for each named view: number, type. `score` compares the two. Look at the sheets before the
key.
"""

import argparse
import math
import random
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from infthor_sim.actions import bind
from infthor_sim.errors import ActionError
from infthor_sim.object_types import OBJECT_TYPES, allowed_in
from infthor_sim.objects import SimObject, default_object
from infthor_sim.physics.free_places import find_place
from infthor_sim.pictures.views import Display
from infthor_sim.scenes.catalogue import Catalogue
from infthor_sim.simulation import Simulation

_ROOMS = ("kitchen", "living-room", "bedroom", "bathroom")
_OPEN = {"CounterTop", "DiningTable", "CoffeeTable", "SideTable", "Desk", "Dresser", "Bed", "Sofa",
         "TVStand", "ArmChair", "Toilet", "ShelvingUnit"}  # fmt: skip
_ANY = {"CounterTop", "DiningTable", "SideTable"}  # where AI2-THOR would not put things, too
_IN_ROOM = 14  # objects that are added to a room
_TRIES = 24
_EDGE = 4  # pixels of a frame's edge that a view must not touch
_FOCUS = 260  # of a 300 pixel frame of 60 degrees, pixels
_COLUMNS, _LINES, _CROP, _TILE = 6, 5, 64, 250
_MARK = "magenta"


@dataclass(frozen=True)
class View:
    """A frame (300, 300, 3) that shows an object, and its box: left, top, right, bottom."""

    object_type: str
    place: str
    pixels: int
    frame: np.ndarray
    box: tuple[int, int, int, int]


def main() -> None:
    """Draw sheets, or score guesses."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("action", choices=("draw", "score"))
    parser.add_argument("out", type=Path)
    parser.add_argument("guesses", type=Path, nargs="?")
    parser.add_argument("--types", default="", help="separated by commas; default: all loose ones")
    parser.add_argument("--views", type=int, default=10)
    parser.add_argument("--pixels", type=int, nargs=2, default=(70, 115))
    parser.add_argument("--seed", type=int, default=1001, help="number of the first rooms")
    parser.add_argument("--rooms", type=int, default=40)
    options = parser.parse_args()
    if options.action == "score":
        print_score(options.out, options.guesses)
        return
    loose = [name for name, declared in OBJECT_TYPES.items() if declared.pickupable]
    types = options.types.split(",") if options.types else loose
    views = collect(types, options)
    random.Random(options.seed).shuffle(views)
    options.out.mkdir(parents=True, exist_ok=True)
    for start in range(0, len(views), _COLUMNS * _LINES):
        sheet(views[start : start + _COLUMNS * _LINES], start).save(
            options.out / f"sheet-{start:03d}.png"
        )
    lines = [f"{n},{v.object_type},{v.pixels},{v.place}\n" for n, v in enumerate(views)]
    (options.out / "key.csv").write_text("".join(lines))
    counts = Counter(view.object_type for view in views)
    print({name: counts[name] for name in types if counts[name] < options.views} or "complete")


def collect(types: list[str], options: argparse.Namespace) -> list[View]:
    """Return up to `views` views of each type, in rooms from the first seed on."""
    rng = np.random.default_rng(options.seed)
    sim = Simulation(Catalogue(), Display(300, 300))
    views: dict[str, list[View]] = {name: [] for name in types}
    for number in range(options.seed, options.seed + options.rooms):
        for room in _ROOMS:
            left = [name for name in types if len(views[name]) < options.views]
            if not left:
                break
            do(sim, "Reset", sceneName=f"{room}-{number}")
            do(sim, "Initialize", fieldOfView=60)
            loose = [name for name in left if not stays(name)]
            chosen = [str(name) for name in rng.permutation(loose)[:_IN_ROOM]]
            there = [o for o in sim.world.objects.values() if o.object_type in left]
            there = [o for o in there if stays(o.object_type)]
            for item in [*there, *add(sim, chosen, rng)]:
                if len(views[item.object_type]) == options.views:
                    continue
                found = look(sim, item, options.pixels, rng, f"{room}-{number}")
                if found is not None:
                    views[item.object_type].append(found)
    return [view for name in types for view in views[name]]


def do(sim: Simulation, action: str, **arguments: object) -> None:
    """Execute one action."""
    method, checked = bind({"action": action, **arguments})
    method.run(sim, **checked)


def stays(object_type: str) -> bool:
    """Return whether objects of a type are looked at where rooms have them."""
    holders = ("HandTowelHolder", "TowelHolder")
    return not OBJECT_TYPES[object_type].pickupable or any(
        allowed_in(object_type, holder) for holder in holders
    )


def add(sim: Simulation, types: list[str], rng: np.random.Generator) -> Iterator[SimObject]:
    """Put an object of each type on open furniture of the room, turned by quarters; yield it."""
    for object_type in types:
        item = default_object(object_type, np.zeros(3))
        homes = [
            o for o in sim.world.objects.values()
            if o.object_type in _OPEN
            and (o.object_type in _ANY or allowed_in(object_type, o.object_type))
        ]  # fmt: skip
        for index in rng.permutation(len(homes)):
            tried = find_place(sim.world, item, homes[index], random=rng)
            if tried is None:
                continue
            yaw = float(rng.choice([0, 90, 180, 270]))
            placed = default_object(object_type, np.round(tried.position, 4), yaw)
            placed.style = int(rng.integers(1000))
            if placed.object_id not in sim.world.objects:
                sim.world.add(placed)
                sim.world.attach(placed, homes[index])
                yield placed
            break


def look(
    sim: Simulation, item: SimObject, pixels: tuple[int, int], rng: np.random.Generator, place: str
) -> View | None:
    """Return a view in which the object has from the least to the most pixels, or None."""
    middle = item.center
    short, long = sorted(map(float, item.box_size))[1:]
    usual = _FOCUS * math.sqrt(0.7 * short * long / sum(pixels) * 2)  # distance, metres
    away = {c: math.hypot(middle[0] - c[0], middle[2] - c[1]) for c in sorted(sim.world.nav)}
    cells = [c for c in away if 0.3 * usual <= away[c] <= 1.2 * usual]
    cells = cells or sorted(away, key=lambda c: -away[c])[:10]
    for _ in range(_TRIES):
        x, z = cells[rng.integers(len(cells))]
        yaw = math.degrees(math.atan2(middle[0] - x, middle[2] - z)) + rng.uniform(-22, 22)
        down = math.degrees(math.atan2(1.575 - middle[1], max(away[x, z], 0.1)))
        horizon = float(min((-30, 0, 30, 60), key=lambda angle: abs(angle - down)))
        try:
            do(sim, "Teleport", position={"x": x, "z": z}, rotation={"y": yaw % 360},
               horizon=horizon)  # fmt: skip
        except ActionError:
            continue  # the agent does not fit there beside what is open
        seen = sim.views.agent_view()
        if item.object_id not in seen.names:
            continue
        mask = (seen.instances == seen.names.index(item.object_id))[::-1]
        rows, columns = np.nonzero(mask)
        if not pixels[0] <= len(rows) <= pixels[1]:
            continue
        box = (int(columns.min()), int(rows.min()), int(columns.max()), int(rows.max()))
        if min(box) >= _EDGE and max(box) < 300 - _EDGE:
            frame = np.ascontiguousarray(sim.views.colours(seen)[::-1])
            return View(item.object_type, place, len(rows), frame, box)
    return None


def sheet(views: list[View], first: int) -> Image.Image:
    """Return a sheet of numbered views, each cut out around the object and marked."""
    out = Image.new("RGB", (_COLUMNS * _TILE, math.ceil(len(views) / _COLUMNS) * _TILE), "white")
    for index, view in enumerate(views):
        row, column = divmod(index, _COLUMNS)
        out.paste(tile(view, first + index), (column * _TILE, row * _TILE))
    return out


def tile(view: View, number: int) -> Image.Image:
    """Return the enlarged surroundings of the object, with corners around it."""
    left, top, right, bottom = view.box
    side = max(_CROP, int(1.5 * max(right - left, bottom - top)))
    x = min(max((left + right - side) // 2, 0), 300 - side)
    y = min(max((top + bottom - side) // 2, 0), 300 - side)
    picture = Image.fromarray(view.frame).crop((x, y, x + side, y + side)).resize((_TILE, _TILE))
    draw = ImageDraw.Draw(picture)
    scale = _TILE / side
    for at_x, inward_x in (((left - x - 2) * scale, 8), ((right - x + 3) * scale, -8)):
        for at_y, inward_y in (((top - y - 2) * scale, 8), ((bottom - y + 3) * scale, -8)):
            draw.line([at_x, at_y, at_x + inward_x, at_y], fill=_MARK, width=2)
            draw.line([at_x, at_y, at_x, at_y + inward_y], fill=_MARK, width=2)
    draw.rectangle([0, 0, 34, 14], fill="white")
    draw.text((2, 1), str(number), fill="black")
    return picture


def print_score(out: Path, guesses: Path) -> None:
    """Print how many views of each type were named right, and what the others were taken for."""
    named = dict(line.split()[:2] for line in guesses.read_text().splitlines() if line.strip())
    right: Counter[str] = Counter()
    wrong: defaultdict[str, list[str]] = defaultdict(list)
    for line in (out / "key.csv").read_text().splitlines():
        number, object_type, pixels, place = line.split(",")
        if named.get(number) == object_type:
            right[object_type] += 1
        elif number in named:
            wrong[object_type].append(f"{named[number]} ({number}: {pixels} pixels, {place})")
    for name in sorted({*right, *wrong}):
        print(f"{name} {right[name]}/{right[name] + len(wrong[name])}", *wrong[name])


if __name__ == "__main__":
    main()
