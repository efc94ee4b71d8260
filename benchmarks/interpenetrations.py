"""Count the things of procedural rooms whose drawings go through one another, as a careful eye sees
them.

    python benchmarks/interpenetrations.py [--rooms 200] [--puts 10] [--against CHECKOUT]
    [--examples]
    python benchmarks/interpenetrations.py --data FOLDER [--puts 10] [--against CHECKOUT]
    [--examples]

With --data it looks at the recorded floor plans of a folder: at rest, where AI2-THOR's boxes and
our drawings of them differ, and at what puts add.

Else, for each room it looks at the drawn solids, and not at the boxes of the metadata, by points
within each: at rest, with each door, drawer and lid opened in turn, which shows what is inside and
moves what opens, and where an agent put things. Two objects interpenetrate if a point of one lies
deeper than a centimetre (for thin boards: beyond their middle) in a solid of the other, or if a
solid crosses the wall of a vessel. Counted are pairs of which at least one is loose, or has just
been opened, or which are not built into one another, and things that go through a wall of the room.
It prints one JSON object: rooms, pairs by where they are seen, the most frequent pairs of types,
and objects per room.
"""

import argparse
import json
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

DEEP = 0.01  # metres; what lies less deep in another thing touches it
TOUCH = 0.003  # metres; thin sheets, as a table's runner, are so thick
_KINDS = ("kitchen", "living-room", "bedroom", "bathroom")
_EDGE = 0.98  # of a solid's half extents: points on its very surface touch what they lie on


def unit_points(form: int, bottom: float, top: float) -> np.ndarray:
    """Return points (n, 3) of a primitive in its own frame, scaled by its half extents; see
    `render.primitives`."""
    from infthor_sim.render.primitives import Form

    steps = np.linspace(-_EDGE, _EDGE, 7)
    grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    if form == Form.BOX:
        return grid
    angles = np.arange(12) * np.pi / 6
    if form in (Form.ELLIPSOID, Form.BOWL):
        heights = np.linspace(-_EDGE, _EDGE if form == Form.ELLIPSOID else 0.0, 7)
        radii = np.sqrt(np.maximum(_EDGE**2 - heights**2, 0))
        if form == Form.BOWL:
            heights = (
                1 + 2 * heights
            )  # the lower half of an ellipsoid is scaled to the whole height
    else:
        heights = steps
        radii = _EDGE * (bottom + (top - bottom) * (heights + 1) / 2)
    hollow = form in (Form.CUP, Form.BOWL)  # of which only the wall is solid
    rings = [
        np.array([[0.0, heights[0], 0.0]])
        if hollow
        else heights[:, None] * np.array([[0.0, 1.0, 0.0]])
    ]
    for share in (1.0,) if hollow else (0.5, 1.0):
        for angle in angles:
            rings.append(
                np.stack(
                    [radii * share * np.cos(angle), heights, radii * share * np.sin(angle)], axis=1
                )
            )
    return np.concatenate(rings)


class Solid:
    """One drawn primitive of an object: its points in the world, and how deep points of others lie
    in it."""

    def __init__(self, row: np.ndarray) -> None:
        from infthor_sim.render.primitives import AXES, BOTTOM, CENTER, FORM, HALF, TOP

        self.form = int(row[FORM])
        self.center, self.half = row[CENTER : CENTER + 3], row[HALF : HALF + 3]
        self.axes = row[AXES : AXES + 9].reshape(3, 3)  # rows: the primitive's axes in the world
        self.bottom, self.top = float(row[BOTTOM]), float(row[TOP])
        local = unit_points(self.form, self.bottom, self.top) * self.half
        self.points = self.center + local @ self.axes
        self.low, self.high = self.points.min(axis=0), self.points.max(axis=0)

    def _radius(self, y: np.ndarray) -> np.ndarray:
        from infthor_sim.render.primitives import Form

        if self.form == Form.BOWL:
            return np.sqrt(np.maximum(1 - ((1 - y) / 2) ** 2, 0))
        return self.bottom + (self.top - self.bottom) * (y + 1) / 2

    def depth(self, points: np.ndarray) -> float:
        """Return how many metres deep the deepest of points (n, 3) lies in this solid; at most 0
        for none.

        For a vessel: how far points lie outside of its wall while others of the same solid are
        inside.
        """
        from infthor_sim.render.primitives import Form

        unit = (points - self.center) @ self.axes.T / self.half
        if self.form == Form.BOX:
            return float(((1 - np.abs(unit)) * self.half).min(axis=1).max())
        wide = float(min(self.half[0], self.half[2]))
        if self.form == Form.ELLIPSOID:
            return float((1 - np.linalg.norm(unit, axis=1)).max()) * float(self.half.min())
        level, away = unit[:, 1], np.hypot(unit[:, 0], unit[:, 2])
        radius = self._radius(np.clip(level, -1, 1))
        if self.form == Form.CYLINDER:
            inside = np.minimum((radius - away) * wide, (1 - np.abs(level)) * float(self.half[1]))
            return float(inside.max())
        within = (level < 0.9) & (level > TOUCH / float(self.half[1]) - 1)
        inner = within & (away < radius)
        if not inner.any():
            return 0.0
        out = within & (away > radius)
        return float(((away - radius) * wide)[out].max()) if out.any() else 0.0

    def thickness(self) -> float:
        """Metres of half its thinnest side."""
        return float(self.half.min())


def solids(item: Any) -> list[Solid]:
    """Return the drawn primitives of an object of the world."""
    from infthor_sim.render.primitives import rows
    from infthor_sim.render.shapes import shape

    return [Solid(row) for row in rows(shape(item), item.position, item.matrix, 0)]


def interpenetrate(mine: list[Solid], theirs: list[Solid]) -> float:
    """Return metres by which two drawn objects go into each other, 0 if they only touch."""
    worst = 0.0
    for a in mine:
        for b in theirs:
            if np.any(a.low > b.high) or np.any(b.low > a.high):
                continue
            for points, solid in ((a.points, b), (b.points, a)):
                deep = solid.depth(points)
                # A thin board is gone through before anything is a centimetre deep in it.
                if deep > min(DEEP, 0.9 * solid.thickness()) and deep > TOUCH:
                    worst = max(worst, deep)
    return worst


def _type_of(name: str) -> str:
    """Return the type in an object id; that of a basin stands last, behind its sink's id."""
    parts = name.split("|")
    return parts[-1] if name.endswith("Basin") else parts[0]


class Room:
    """One world, its objects' drawings kept by the objects' versions."""

    def __init__(self, world: Any) -> None:
        self.world = world
        self._solids: dict[str, tuple[int, list[Solid]]] = {}

    def drawn(self, item: Any) -> list[Solid]:
        """Return an object's solids as it is now."""
        kept = self._solids.get(item.object_id)
        if kept is None or kept[0] != item.version:
            kept = self._solids[item.object_id] = (item.version, solids(item))
        return kept[1]

    def pairs(self, seen_by: set[str] | None = None) -> Iterator[tuple[str, str, float]]:
        """Yield pairs of ids that go into each other and how deep; only with one of `seen_by`, if
        given."""
        shown = [
            o
            for o in self.world.objects.values()
            if not self.world.is_hidden(o) and o.object_type != "Floor"
        ]
        boxes = {}
        for item in shown:
            parts = self.drawn(item)
            if parts:
                boxes[item.object_id] = (
                    np.min([p.low for p in parts], axis=0), np.max([p.high for p in parts], axis=0),
                )  # fmt: skip
        listed = [o for o in shown if o.object_id in boxes]
        for number, a in enumerate(listed):
            for b in listed[number + 1 :]:
                if seen_by is not None and not {a.object_id, b.object_id} & seen_by:
                    continue
                if not self._counts(a, b, seen_by or set()):
                    continue
                (low_a, high_a), (low_b, high_b) = boxes[a.object_id], boxes[b.object_id]
                if np.any(low_a > high_b) or np.any(low_b > high_a):
                    continue
                deep = interpenetrate(self.drawn(a), self.drawn(b))
                if deep:
                    yield a.object_id, b.object_id, deep

    @staticmethod
    def _counts(a: Any, b: Any, opened: set[str]) -> bool:
        """Return whether a pair can be a fault: parts of furniture that are built into each other
        are none."""
        if any(x.parent == y.object_id and y.type.overhang for x, y in ((a, b), (b, a))):
            return (
                False  # what hangs over a rail goes around it, and dishes may have things stick out
            )
        if a.type.pickupable or b.type.pickupable:
            return True
        fixed = {
            "CounterTop",
            "Dresser",
            "TVStand",
            "Desk",
            "SideTable",
            "Sink",
            "SinkBasin",
            "Bathtub",
            "BathtubBasin",
        }
        built = [
            o.type.built_in or o.object_type in {*fixed, "StoveKnob", "StoveBurner", "Faucet"}
            for o in (a, b)
        ]
        return not all(built) or bool(
            {a.object_id, b.object_id} & opened and all(o.type.openable for o in (a, b))
        )

    def through_walls(self) -> Iterator[tuple[str, str, float]]:
        """Yield loose objects that go through a wall of the room they are in."""
        for item in self.world.objects.values():
            if not item.type.pickupable or self.world.is_hidden(item):
                continue
            parts = self.drawn(item)
            low, high = (
                np.min([p.low for p in parts], axis=0),
                np.max([p.high for p in parts], axis=0),
            )
            middle = (low + high) / 2
            room = next(
                (
                    r
                    for r in self.world.rooms
                    if r.x_min <= middle[0] <= r.x_max and r.z_min <= middle[2] <= r.z_max
                ),
                None,
            )
            if room is None:
                yield item.object_id, "Wall", 1.0
                continue
            deep = max(
                room.x_min - low[0], high[0] - room.x_max, room.z_min - low[2], high[2] - room.z_max
            )
            if deep > 0.002:
                yield item.object_id, "Wall", float(deep)


def open_one(world: Any, item: Any, openness: float) -> None:
    """Open or close an object as its action does, whatever stands in the way."""
    from infthor_sim.physics.receptacles import drawer_offset
    from infthor_sim.physics.solids import unfold

    before = drawer_offset(item)
    unfold(item, openness)
    item.state.openness = openness
    world.mark_changed(item)
    world.shift(world.children(item), drawer_offset(item) - before)


def faults(world: Any) -> dict[str, set[tuple[str, str]]]:
    """Return the pairs of objects that go through each other in one room, by where they are
    seen."""
    room = Room(world)
    found: dict[str, set[tuple[str, str]]] = {
        "at rest": {(a, b) for a, b, _ in room.pairs()},
        "wall": {(a, b) for a, b, _ in room.through_walls()},
    }  # fmt: skip
    opened: set[tuple[str, str]] = set()
    for item in list(world.objects.values()):
        if not item.type.openable or item.state.openness > 0 or world.is_hidden(item):
            continue
        if not (item.type.hinged or item.type.slides or item.type.encloses):
            continue
        for openness in (1.0, 0.5):
            open_one(world, item, openness)
            concerned = {item.object_id, *(o.object_id for o in world.descendants(item))}
            opened |= {(a, b) for a, b, _ in room.pairs(concerned)}
        open_one(world, item, 0.0)
    found["opened"] = opened - found["at rest"]
    return found


def face(server: Any, object_id: str) -> bool:
    """Stand where an object can be used; return whether there is such a place."""
    outcome = server.run({"action": "GetInteractablePoses", "objectId": object_id})[0]
    poses = outcome.value or []
    if poses:
        pose = poses[len(poses) // 2]
        server.run({"action": "TeleportFull", **pose, "rotation": {"y": pose["rotation"]}})
    return bool(poses)


def faults_of_puts(
    scene: str, n_puts: int, random: np.random.Generator, catalogue: Any
) -> dict[str, set[tuple[str, str]]]:
    """Return the pairs at rest, and those that arise when an agent puts loose things into or onto
    what takes them, one after the other."""
    from infthor_sim.object_types import allowed_in
    from infthor_sim.player.server import SimulatorServer
    from infthor_sim.simulation import Simulation

    server = SimulatorServer(sim := Simulation(catalogue))
    server.run({"action": "Reset", "sceneName": scene})
    server.run({"action": "Initialize"})
    room, world, found = Room(sim.world), sim.world, set[tuple[str, str]]()
    before = {(a, b) for a, b, _ in room.pairs()}
    for _ in range(n_puts):
        loose = [o for o in world.objects.values() if o.type.pickupable]
        item = loose[int(random.integers(len(loose)))]
        homes = [o for o in world.objects.values() if allowed_in(item.object_type,
                                                                 o.object_type) and o is not item
                 and o not in world.descendants(item)]  # fmt: skip
        if not homes:
            continue
        home = homes[int(random.integers(len(homes)))]
        server.run({"action": "PickupObject", "objectId": item.object_id, "forceAction": True})
        if home.type.openable and home.state.openness == 0:
            server.run({"action": "OpenObject", "objectId": home.object_id, "forceAction": True})
        # In a recording an agent puts things where it stands and looks: a forced put goes anywhere.
        if world.coarse and not face(server, home.object_id):
            server.run({"action": "DropHandObject", "forceAction": True})
            continue
        server.run(
            {"action": "PutObject", "objectId": home.object_id, "forceAction": not world.coarse}
        )
        if world.agent.held is not None:  # there was no room
            server.run({"action": "DropHandObject", "forceAction": True})
            continue
        found |= {(a, b) for a, b, _ in room.pairs({item.object_id})} - before
    return {"at rest": before, "put": found}


def rooms_looked_at(
    n_rooms: int, n_puts: int, data: Path | None
) -> Iterator[tuple[str, int, dict[str, set[tuple[str, str]]]]]:
    """Yield each room's name, its number of objects, and its pairs by where they are seen."""
    from infthor_sim.scenes.catalogue import Catalogue, FloorPlanData

    catalogue = Catalogue(data)
    names = [f"{_KINDS[index % 4]}-{1000 + index // 4}" for index in range(n_rooms)]
    for index, name in enumerate(names if data is None else FloorPlanData(data).scenes()):
        puts = faults_of_puts(name, n_puts, np.random.default_rng(index), catalogue)
        world = catalogue.load(name)
        yield name, len(world.objects), puts if data else {**puts, **faults(world)}


def count(n_rooms: int, n_puts: int, data: Path | None = None) -> dict[str, Any]:
    """Return all numbers, see the module's docstring."""
    pairs, types, examples, n_objects = Counter[str](), Counter[str](), {}, 0
    with_fault = n_looked_at = 0
    for name, n_in_room, found in rooms_looked_at(n_rooms, n_puts, data):
        n_looked_at += 1
        n_objects += n_in_room
        with_fault += any(found.values())
        for where, listed in found.items():
            pairs[where] += len(listed)
            for a, b in listed:
                key = f"{where}: " + " / ".join(sorted(map(_type_of, (a, b))))
                types[key] += 1
                examples.setdefault(key, f"{name}: {a} and {b}")
    return {
        "rooms": n_looked_at, "objects": n_objects, "pairs": sum(pairs.values()),
        "by_place": dict(pairs),
        "rooms_with_a_fault": with_fault, "most_frequent": dict(types.most_common()),
        "examples": examples,
    }  # fmt: skip


def main() -> None:
    """Parse the arguments and print the numbers."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--rooms", type=int, default=200, help="rooms, of the four kinds in turn, from seed 1000"
    )
    parser.add_argument(
        "--puts", type=int, default=10, help="things that an agent puts somewhere, in each room"
    )
    parser.add_argument(
        "--against", metavar="CHECKOUT", help="also count with the simulator of another checkout"
    )
    parser.add_argument(
        "--examples", action="store_true", help="name a pair of objects of each kind of pair"
    )
    parser.add_argument(
        "--data", type=Path, metavar="FOLDER", help="recorded floor plans, instead of rooms"
    )
    options = parser.parse_args()
    result = count(options.rooms, options.puts, options.data)
    if not options.examples:
        del result["examples"]
    if options.against:
        # This file, with the other checkout's simulator.
        command = [
            sys.executable,
            __file__,
            "--rooms",
            str(options.rooms),
            "--puts",
            str(options.puts),
            *(["--data", str(options.data)] if options.data else []),
        ]
        environment = {**os.environ, "PYTHONPATH": str(Path(options.against).resolve())}
        result = {
            "other": json.loads(
                subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE).stdout
            ),
            "ours": result,
        }
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
