"""Guess which world of a pair of twins is the original, with a learner that sees both.

python benchmarks/twins_original.py SET [SET ...] [--flips 60]

A logistic regression on what differs between the two worlds: how common their places are in the
other rooms, ids and poses, pictures, words of answers and tasks, clues, names. It learns on the
pairs of all other rooms. Kinds whose worlds are both edits have no original and are left out.

What it would guess if nothing told: the originals of a room's pairs are flipped together, by coin
for each room, and it learns again. Pairs of a room have objects in common, so that this spreads
more than the standard errors of the table, which take pairs for independent.
"""

import argparse
import math
import random
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from PIL import Image

from infthor_eval.formats.step_log import ObjectState, Step, iter_object_states, read_steps
from infthor_eval.formats.twins import TwinPair
from infthor_eval.generation.twins.drafting import TwinDraft, is_flipped

# Kinds of which one world is the episode's own.
KINDS = ("swap-task", "swap-sliced", "move", "replace")
_STRENGTH = 1.0  # of the prior on each weight, of features of unit size
_STEPS = 50  # of Newton's method, at most
_Place = tuple[str, str]  # a type and that of what it is in or on


@dataclass
class World:
    """One world of a pair.

    Attributes:
        out: folder of the set.
        pair: the pair.
        side: 0 or 1.
    """

    out: Path
    pair: TwinPair
    side: int

    @property
    def folder(self) -> Path:
        """Folder of its logs."""
        return self.out / "metadata" / self.pair.traj_ids[self.side]

    @cached_property
    def steps(self) -> Sequence[Step]:
        """Its log."""
        return read_steps(self.folder)

    @cached_property
    def start(self) -> dict[str, ObjectState]:
        """States at the start, by id."""
        (states,) = islice(iter_object_states(self.steps), 1)
        return {key: state for key, state in states.items() if state.exists}

    @cached_property
    def document(self) -> dict[str, Any]:
        """The trajectory as it is written."""
        return dict(msgspec.json.decode((self.folder / "traj_data.json").read_bytes()))

    @cached_property
    def changed(self) -> dict[str, ObjectState]:
        """The objects of the edit that are there at the start."""
        keys = [self.pair.ids.get(key, key) if self.side else key for key in self.pair.changed]
        return {key: self.start[key] for key in keys if key in self.start}

    def parent(self, state: ObjectState) -> str:
        """Return the type of what an object is directly in or on."""
        known = [self.start[key].type for key in state.parents if key in self.start]
        return known[0] if known else ""

    def places(self) -> Counter[_Place]:
        """Count the types of objects, with those of their places, that the edit leaves alone."""
        left = (state for key, state in self.start.items() if key not in self.changed)
        return Counter((state.type, self.parent(state)) for state in left)

    def puts(self) -> list[_Place]:
        """Return the types of what is put, with those of where."""
        done = (step for step in self.steps if step.success and step.receptacle and step.target)
        return [(_head(step.target), _head(step.receptacle)) for step in done]


def _head(key: str | None) -> str:
    return (key or "").partition("|")[0]


@dataclass
class Rooms:
    """What is common in the other rooms, by room."""

    places: dict[str, Counter[_Place]] = field(default_factory=dict)
    puts: dict[str, Counter[_Place]] = field(default_factory=lambda: defaultdict(Counter))
    answers: dict[str, Counter[str]] = field(default_factory=lambda: defaultdict(Counter))

    def add(self, world: World) -> None:
        """Count a world."""
        rooms = world.pair.floor_plan
        self.places.setdefault(rooms, world.places())
        self.puts[rooms].update(world.puts())
        for question in world.pair.questions:
            self.answers[rooms].update(map(str, question.answers[world.side]))

    @staticmethod
    def log_counts(counts: Mapping[str, Counter[Any]], room: str, things: Iterable[Any]) -> float:
        """Return the sum of the logarithms of how often things are in other rooms."""
        others = [counter for name, counter in counts.items() if name != room]
        return sum(math.log(sum(counter[thing] for counter in others) + 0.5) for thing in things)


def features(world: World, rooms: Rooms) -> Iterator[tuple[str, float]]:
    """Yield what a cheat would look at in a world, by group and name; equal names add up."""
    yield from _of_places(world, rooms)
    yield from _of_poses(world)
    yield from _of_pictures(world)
    yield from _of_words(world, rooms)
    yield from _of_clues(world)


def _of_places(world: World, rooms: Rooms) -> Iterator[tuple[str, float]]:
    room = world.pair.floor_plan
    changed = [(state.type, world.parent(state)) for state in world.changed.values()]
    yield "places: common", rooms.log_counts(rooms.places, room, changed)
    least = [rooms.log_counts(rooms.places, room, [place]) for place in changed]
    yield "places: least common", min(least, default=0.0)
    by_type = {name: Counter(_by_first(counter)) for name, counter in rooms.places.items()}
    yield "places: types", rooms.log_counts(by_type, room, [name for name, _ in changed])
    yield "places: puts", rooms.log_counts(rooms.puts, room, world.puts())


def _by_first(counter: Counter[_Place]) -> Counter[str]:
    counts: Counter[str] = Counter()
    for (first, _), count in counter.items():
        counts[first] += count
    return counts


def _of_poses(world: World) -> Iterator[tuple[str, float]]:
    poses = {pose["objectName"]: pose for pose in world.document["scene"]["object_poses"]}
    yield "poses: far off", sum(abs(pose["position"]["y"]) > 5 for pose in poses.values())
    by_place = {
        tuple(round(pose["position"][axis], 3) for axis in "xyz"): pose for pose in poses.values()
    }
    for key, state in world.changed.items():
        digits = [float(number) for number in key.split("|")[1:4]]
        yield (
            "poses: id is not the place",
            max(abs(one - other) for one, other in zip(digits, state.position, strict=True))
            > 0.006,
        )
        yield "poses: digits", sum(round(abs(number) * 100) % 5 == 0 for number in digits)
        yield "poses: height", state.position[1]
        yield from _of_neighbours(world, key, state, by_place)


def _of_neighbours(
    world: World, key: str, state: ObjectState, poses: Mapping[Any, Any]
) -> Iterator[tuple[str, float]]:
    pose = poses.get(state.position)
    beside = [
        other
        for name, other in world.start.items()
        if name not in world.changed and other.parents == state.parents and state.parents
    ]
    yield "poses: beside", len(beside)
    away = [math.dist(state.position, other.position) for other in beside]
    yield "poses: nearest", min(away, default=0.5)
    yield "poses: near", min(away, default=0.5) < 0.08
    holder = world.start.get(state.parents[0]) if state.parents else None
    if holder is not None:
        yield "poses: from the middle", math.dist(state.position, holder.position)
    if pose is not None:
        yield "poses: decimals", sum(len(str(pose["position"][axis])) for axis in "xyz")
        yaws = [
            poses[other.position]["rotation"]["y"] for other in beside if other.position in poses
        ]
        turns = [round(abs(yaw - pose["rotation"]["y"]) % 360) for yaw in yaws]
        yield (
            "poses: turned unlike those beside",
            sum(turn != 0 for turn in turns) / max(1, len(turns)),
        )
        yield "poses: turned by 90 degrees", sum(turn % 180 == 90 for turn in turns)
        yield f"poses: yaw {round(pose['rotation']['y'])}", 1.0
    yield f"poses: {key.partition('|')[0]} at {world.parent(state)}", 1.0


def _turn(one: dict[str, Any], other: dict[str, Any]) -> int:
    """Return by how many degrees one pose is turned from another."""
    return round(abs(one["rotation"]["y"] - other["rotation"]["y"]) % 360)


def _of_pictures(world: World) -> Iterator[tuple[str, float]]:
    names = (world.folder / "frames.txt").read_text().splitlines()
    differing = [number for number, frame in enumerate(world.pair.frames) if not frame.same]
    shown = [
        one
        for number in differing
        for key, one in (world.steps[number].seen or {}).items()
        if key in world.changed
    ]
    sizes = [one.pixels for one in shown]
    away = [math.dist(np.add(one.box[:2], one.box[2:]) / 2, (150, 150)) for one in shown]
    yield "pictures: frames that show it", len(shown)
    yield "pictures: its pixels", float(np.mean(sizes or [0]))
    yield "pictures: largest", max(sizes, default=0)
    yield "pictures: from the middle", float(np.mean(away or [0]))
    values = []
    for number in differing:
        path = world.out / "frames" / f"{names[number]}.png"
        picture = np.asarray(Image.open(path).convert("RGB"), dtype=float)
        values.append([path.stat().st_size, *picture.mean((0, 1)), picture.std()])
    means = np.mean(values, axis=0) if values else np.zeros(5)
    for name, value in zip(("bytes", "red", "green", "blue", "contrast"), means, strict=True):
        yield f"pictures: {name}", float(value)


def _of_words(world: World, rooms: Rooms) -> Iterator[tuple[str, float]]:
    answers = [str(word) for one in world.pair.questions for word in one.answers[world.side]]
    yield "words: common", rooms.log_counts(rooms.answers, world.pair.floor_plan, answers)
    yield "words: number of answers", len(answers)
    for word in answers:
        yield f"words: {word}", 1.0
    tasks = " ".join(str(part.get("subgoal", "")) for part in world.document["sub_trajs"])
    for word in re.findall(r"[a-z]+", tasks.lower()):
        yield f"words: task {word}", 1.0


def _of_clues(world: World) -> Iterator[tuple[str, float]]:
    for question in world.pair.questions:
        clues = question.own_clues[world.side]
        yield "clues: own", len(clues)
        yield "clues: none", not clues and not question.absence[world.side]
        yield "clues: absence", question.absence[world.side]
        yield "clues: place", sum(clues) / max(1, len(clues)) / len(world.pair.frames)


@dataclass
class Example:
    """A pair as the learner sees it: what differs, by feature; `original` is 0 or 1."""

    kind: str
    room: str
    original: int
    differences: dict[str, float]


def read_examples(sets: Sequence[Path]) -> list[Example]:
    """Return the pairs of some sets that have an original."""
    worlds = []
    for out in sets:
        for file in sorted(out.glob("drafts/*.draft")):
            pairs = msgspec.json.decode(file.read_bytes(), type=TwinDraft).pairs
            worlds += [
                (World(out, pair, 0), World(out, pair, 1)) for pair in pairs if pair.kind in KINDS
            ]
    rooms = Rooms()
    for both in worlds:
        for world in both:
            rooms.add(world)
    examples = []
    for first, second in worlds:
        differences: Counter[str] = Counter()
        for world, sign in ((first, 1.0), (second, -1.0)):
            for name, value in features(world, rooms):
                differences[name] += sign * value
        names = first.pair.traj_ids
        differences["names: first"] = 1.0
        differences["names: order"] = 1.0 if names[0] < names[1] else -1.0
        original = int(is_flipped(first.pair.id))
        examples.append(Example(first.pair.kind, first.pair.floor_plan, original, differences))
    return examples


def guesses(examples: Sequence[Example], group: str) -> list[float]:
    """Return for each pair 1 if the learner of the other rooms is right, 0.5 if it cannot tell."""
    seen = Counter(name for one in examples for name, value in one.differences.items() if value)
    names = sorted(name for name in seen if name.startswith(group) and seen[name] > 2)
    x = np.array([[one.differences.get(name, 0.0) for name in names] for one in examples])
    y = np.array([1.0 if one.original == 0 else 0.0 for one in examples])
    x = x / np.maximum(1e-9, np.sqrt((x**2).mean(axis=0)))
    rooms = np.array([one.room for one in examples])
    right = np.full(len(examples), 0.5)
    for room in sorted(set(rooms)):
        held_out = rooms == room
        score = x[held_out] @ fit(x[~held_out], y[~held_out])
        right[held_out] = np.where(score == 0, 0.5, (score > 0) == (y[held_out] > 0.5))
    return [float(value) for value in right]


def fit(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the weights of a logistic regression without intercept, by Newton's method.

    An intercept is one of the features.
    """
    weights = np.zeros(x.shape[1])
    strength = _STRENGTH * np.sqrt(x.shape[1])
    for _ in range(_STEPS):
        chance = 1 / (1 + np.exp(-np.clip(x @ weights, -30, 30)))
        gradient = x.T @ (chance - y) + strength * weights
        curvature = (x * (chance * (1 - chance))[:, None]).T @ x + strength * np.eye(len(weights))
        step = np.linalg.solve(curvature, gradient)
        weights -= step
        if np.abs(step).max(initial=0.0) < 1e-6:
            break
    return weights


def print_guesses(examples: Sequence[Example]) -> None:
    """Print the share of originals that are guessed, with standard errors, by kind and features."""
    groups = [
        "",
        *sorted({f"{name.partition(':')[0]}:" for one in examples for name in one.differences}),
    ]
    kinds = [kind for kind in KINDS if any(one.kind == kind for one in examples)]
    print("| features | all | " + " | ".join(f"`{kind}`" for kind in kinds) + " |")
    print("|---" * (len(kinds) + 2) + "|")
    for group in groups:
        right = guesses(examples, group)
        cells = [_share(right)]
        for kind in kinds:
            cells.append(
                _share([r for r, one in zip(right, examples, strict=True) if one.kind == kind])
            )
        print(f"| {group.rstrip(':') or 'all'} | " + " | ".join(cells) + " |")


def _share(right: Sequence[float]) -> str:
    share = float(np.mean(right))
    error = math.sqrt(share * (1 - share) / len(right))
    return f"{100 * share:.1f} ± {100 * error:.1f} ({len(right)})"


def print_flipped(examples: Sequence[Example], n_flips: int) -> None:
    """Print what is guessed where nothing tells, and how often that is as much as is guessed."""
    rng = random.Random(0)
    found = float(np.mean(guesses(examples, "")))
    shares = []
    for _ in range(n_flips):
        flipped = {room for room in sorted({one.room for one in examples}) if rng.random() < 0.5}
        turned = [replace(one, original=one.original ^ (one.room in flipped)) for one in examples]
        shares.append(float(np.mean(guesses(turned, ""))))
    print(
        f"with rooms flipped: {100 * np.mean(shares):.1f} ± {100 * np.std(shares):.1f}; at least "
        f"{100 * found:.1f} in {sum(share >= found for share in shares)} of {n_flips}"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sets", type=Path, nargs="+")
    parser.add_argument("--flips", type=int, default=60)
    options = parser.parse_args()
    examples = read_examples(options.sets)
    print_guesses(examples)
    print_flipped(examples, options.flips)


if __name__ == "__main__":
    main()
