"""Finding a way for an arm among solids: through poses that are drawn, looked at only where they would be passed."""

import heapq
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from infthor_eval.manipulation.linkage import Array, Linkage, Poses, turned
from infthor_eval.manipulation.solids import Solids, gaps

__all__ = ["Contact", "Kind", "Move", "Roadmap", "Terrain", "first_of"]

_STEP, _ANGLE = 0.03, math.radians(5.0)  # metres and radians from one look at what is in the way to the next
_MARGIN = 0.01  # metres that are kept from solids
_STUCK = 0.02  # metres deep from which the arm is not touching a solid: it is not where its box says
_NEAR = 0.05  # metres around a contact of the hand, and of what it holds, that are not tried again
_NEIGHBOURS = 14  # of a pose
_GLANCE = 3  # of so many poses on a way one is looked at first
_HARD, _CLOSE = 0.15, 0.12  # metres of way that edges cost more which pass so near to where something is met
_LEARNT = 3  # poses of each edge
_LOOKS = 150  # at edges, until a search is given up
_SAME = 1e-3  # metres and radians of rounding
_MOVE, _BASE, _TURN = 0.15, 0.5, 0.25  # costs: of a movement, and of a metre of the base and a radian in metres
_FURTHEST = 2.0  # metres and more: edges that are longer are left out
_FAR_TURN = math.radians(170.0)  # and turns that are nearly half: which way they go is a matter of rounding


@dataclass(frozen=True)
class Contact:
    """Where the arm met something.

    Attributes:
        wrist: where the wrist was, metres (3,).
        held: where the middle of what it holds was.
        on_goal: whether that was what something is to be put into or onto.
    """

    wrist: Array
    held: Array
    on_goal: bool = False


class Kind(IntEnum):
    """Movements: of the base up or down, of the wrist in a straight line, of the hand about the wrist."""

    LIFT = 0
    REACH = 1
    TURN = 2


@dataclass(frozen=True)
class Move:
    """One movement of an arm.

    Attributes:
        kind: which.
        pose: after it (1).
    """

    kind: Kind
    pose: Poses


_Stretch = tuple[Kind, Poses]  # the kind of a movement and the poses (n) on its way


class Terrain:
    """What an arm can and cannot do where it stands.

    Attributes:
        linkage: the arm, measured in its present pose.
        contacts: where something was met.
    """

    def __init__(self, linkage: Linkage, solids: Solids, contacts: Sequence[Contact], *, escapes: bool = False) -> None:
        """Look at solids from the present pose.

        Args:
            linkage: the arm, as it is now.
            solids: what is in its way.
            contacts: where something was met.
            escapes: whether what is deep in a thing may leave it through other parts of it, as the embedded
                simulator lets it; in Unity it is stuck.
        """
        self._deepest = -_STUCK if escapes else -np.inf
        self.linkage = linkage
        self._solids = solids
        self.contacts = contacts
        self._least = _allowed(self._gaps(linkage.now)[0])
        self._start = self._from_contacts(linkage.now)

    def free(self, poses: Poses) -> NDArray[np.bool_]:
        """Whether (n,) nothing is in the way of some poses; the arm may be as deep in a thing as it is now."""
        clear = self.linkage.reached(poses)
        if clear.any():
            clear[clear] = (self._gaps(poses[clear]) >= self._least).all(axis=(1, 2))
        return clear & (self._from_contacts(poses) >= _NEAR).all(axis=1)

    def way(self, start: Poses, end: Poses) -> tuple[list[Move] | None, Poses]:
        """Movements from one pose (1) to another, at most one of each kind, in an order in which they are free.

        Returns:
            The movements, None where there are none; and the first poses (n) in which something is met otherwise.
        """
        sizes = _sizes(start, end)[:, 0]
        if sizes[Kind.TURN] > _FAR_TURN:
            return None, end[:0]
        kinds = [kind for kind in Kind if sizes[kind] > _SAME]
        if not kinds:
            return [], end[:0]
        spans = _spans(start, end, sizes)
        orders = [list(_moves(start, order, spans)) for order in itertools.permutations(kinds)]
        leaving = start is self.linkage.now
        promising, met = self._promising(orders, leaving=leaving)
        for moves in promising:
            blocked = self._blocked(start, [stances for _, stances in moves], leaving=leaving)
            if blocked is None:
                return [Move(kind, stances[-1:]) for kind, stances in moves], end[:0]
            met.append(blocked)
        return None, Poses.join(met)

    def _promising(self, orders: list[list[_Stretch]], *, leaving: bool) -> tuple[list[list[_Stretch]], list[Poses]]:
        """Those of some ways on which a glance, at a few poses of each, meets nothing; and what others meet first."""
        glances = [Poses.join([stances[::-_GLANCE][::-1] for _, stances in moves]) for moves in orders]
        every = Poses.join(glances)
        least = np.where(self._least < self._deepest, -np.inf, self._least) if leaving else self._least
        clear = (self._gaps(every) >= least).all(axis=(1, 2))
        ends = np.cumsum([len(part) for part in glances])[:-1]
        found: list[list[_Stretch]] = []
        met: list[Poses] = []
        for moves, part, seen in zip(orders, glances, np.split(clear, ends), strict=True):
            if seen.all():
                found.append(moves)
            else:
                first = int(np.argmin(seen))
                met.append(part[first : first + 1])
        return found, met

    def _blocked(self, start: Poses, moves: list[Poses], *, leaving: bool) -> Poses | None:
        """The first pose (1) in which movements, one after the other, meet something; None where they do not.

        What touches a thing at the start of a movement may not get deeper into it; what is in a thing may leave it
        through other parts of it, if that is believed.
        """
        path = Poses.join([start, *moves])
        least = np.minimum(_NEAR, self._start - _SAME) if leaving else _NEAR
        bad = ~self.linkage.reached(path) | (self._from_contacts(path) < least).any(axis=1)
        found = self._gaps(path)
        first = 0
        for move in moves:
            last = first + len(move)
            lowest = _allowed(found[first])
            on_the_way = np.where(lowest < self._deepest, -np.inf, lowest)
            bad[first + 1 : last] |= (found[first + 1 : last] < on_the_way).any(axis=(1, 2))
            bad[last] |= bool((found[last] < lowest).any())
            first = last
        bad[0] = False
        return path[np.flatnonzero(bad)[:1]] if bad.any() else None

    def _gaps(self, poses: Poses) -> Array:
        """How far (n, parts, things) the arm's parts are from things."""
        return gaps(self.linkage.parts(poses), self._solids)

    def _from_contacts(self, poses: Poses) -> Array:
        """How far (n, contacts) poses are from where something was met, metres."""
        if not self.contacts:
            return np.zeros((len(poses), 0))
        wrists, held = poses.world(), self.linkage.held(poses).center[:, 0]
        return np.stack(
            [
                np.maximum(np.linalg.norm(wrists - c.wrist, axis=1), np.linalg.norm(held - c.held, axis=1))
                for c in self.contacts
            ],
            axis=1,
        )


def _allowed(found: Array) -> Array:
    """How near parts may come to things, or how deep be in them, that are so far from them at the start."""
    allowed: Array = np.minimum(_MARGIN, found - _SAME)
    return allowed


def _moves(start: Poses, order: Sequence[Kind], spans: Sequence[Array]) -> Iterator[_Stretch]:
    """Each movement of an order, with the poses on its way (n); `spans` has what each kind changes, step by step."""
    done = {Kind.LIFT: start.bases, Kind.REACH: start.wrists, Kind.TURN: start.turns}
    for kind in order:
        count = len(spans[kind])
        values = {k: spans[k] if k == kind else np.repeat(done[k], count, axis=0) for k in done}
        stances = Poses(values[Kind.REACH], values[Kind.LIFT], values[Kind.TURN])
        yield kind, stances
        done[kind] = spans[kind][-1:]


def _spans(start: Poses, end: Poses, sizes: Array) -> list[Array]:
    """What each kind of movement (base, wrist, turn) changes on its way from one pose (1) to another, step by step."""
    shares = [
        np.linspace(0.0, 1.0, max(1, math.ceil(float(size) / step)) + 1)[1:]
        for size, step in zip(sizes, (_STEP, _STEP, _ANGLE), strict=True)
    ]
    bases = start.bases + shares[0] * (end.bases - start.bases)
    wrists = start.wrists + shares[1][:, None] * (end.wrists - start.wrists)
    return [bases, wrists, _between(start.turns[0], end.turns[0], shares[2])]


def _sizes(start: Poses, end: Poses) -> Array:
    """How far (3, n) poses are from others: metres of the base, metres of the wrist, radians."""
    cosine = (np.einsum("nij,nij->n", start.turns, end.turns) - 1.0) / 2.0
    return np.stack([
        np.abs(end.bases - start.bases), np.linalg.norm(end.wrists - start.wrists, axis=1),
        np.arccos(np.clip(cosine, -1.0, 1.0)),
    ])  # fmt: skip


def _between(start: Array, end: Array, shares: Array) -> Array:
    """Rotations (n, 3, 3) on the shortest way from one to another."""
    turn = start.T @ end
    skew = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine = float(np.linalg.norm(skew))
    angle = math.atan2(sine, float(np.trace(turn)) - 1.0)
    made: Array = start @ turned(skew / max(sine, 1e-9), shares * angle)
    made[-1] = end
    return made


class Roadmap:
    """Poses that are free, and what it costs to go from one to another."""

    def __init__(self, terrain: Terrain, others: Poses, ends: Poses, costs: Array) -> None:
        """Collect poses: the present one, those that may be passed (n), those to come to (m) and their costs (m,)."""
        self._terrain, self._costs = terrain, costs
        self._poses = Poses.join([terrain.linkage.now, ends, others])
        self._n_ends = len(ends)
        self._ways: dict[tuple[int, int], list[Move] | None] = {}
        self._lengths = self._measured()
        self._edges = np.nonzero(np.isfinite(self._lengths))
        spots = self._spots_of(self._poses)
        self._from, self._line = spots[self._edges[0]], spots[self._edges[1]] - spots[self._edges[0]]
        self._square = np.maximum((self._line**2).sum(axis=1), _SAME)

    def _measured(self) -> Array:
        """Costs (n, n) of going from each pose to each other; none where that is too far."""
        p = self._poses
        count = len(p)
        wide = np.linalg.norm(p.wrists[:, None] - p.wrists[None], axis=2)
        high = np.abs(p.bases[:, None] - p.bases[None])
        flat = p.turns.reshape(count, 9)
        angle = np.arccos(np.clip((flat @ flat.T - 1.0) / 2.0, -1.0, 1.0))
        lengths = wide + _BASE * high + _TURN * angle
        lengths += _MOVE * ((wide > _SAME) + (high > _SAME) * 1.0 + (angle > _SAME))
        lengths[(lengths > _FURTHEST) | (angle > _FAR_TURN)] = np.inf
        np.fill_diagonal(lengths, np.inf)
        nearest = np.argsort(lengths, axis=1)[:, _NEIGHBOURS:]
        kept = np.ones_like(lengths, dtype=bool)
        np.put_along_axis(kept, nearest, values=False, axis=1)
        kept[0, : 1 + self._n_ends] = True
        lengths[~(kept | kept.T)] = np.inf
        return lengths

    def way(self) -> list[Move] | None:
        """The cheapest way that is free; None where none is found."""
        for _ in range(_LOOKS):
            path = self._cheapest()
            if path is None:
                return None
            blocked = next((edge for edge in itertools.pairwise(path) if self._edge(*edge) is None), None)
            if blocked is None:
                return self._shortened(path)
            self._lengths[blocked] = self._lengths[blocked[::-1]] = np.inf
        return None

    def _edge(self, start: int, end: int) -> list[Move] | None:
        if (start, end) not in self._ways:
            self._ways[start, end], met = self._terrain.way(self._pose(start), self._pose(end))
            self._learn(met)
        return self._ways[start, end]

    def _learn(self, met: Poses) -> None:
        """Make ways that pass by poses in which something was met dearer: they are likely to meet it too."""
        starts, ends = self._edges
        for spot in self._spots_of(met[:_LEARNT]):
            apart = spot - self._from
            share = np.clip(np.einsum("ij,ij->i", apart, self._line) / self._square, 0.0, 1.0)
            apart -= share[:, None] * self._line
            near = np.einsum("ij,ij->i", apart, apart) < _CLOSE**2
            self._lengths[starts[near], ends[near]] += _HARD

    def _spots_of(self, poses: Poses) -> Array:
        """Where the wrist is in poses (n, 6), and the middle of what is held, metres."""
        return np.concatenate([poses.world(), self._terrain.linkage.held(poses).center[:, 0]], axis=1)

    def _pose(self, index: int) -> Poses:
        return self._poses[index : index + 1] if index else self._terrain.linkage.now

    def _cheapest(self) -> list[int] | None:
        """The way of least cost by what is known, as indices of poses."""
        best = np.full(len(self._poses), np.inf)
        best[0] = 0.0
        came: dict[int, int] = {}
        queue: list[tuple[float, int, bool]] = [(0.0, 0, False)]
        while queue:
            cost, index, is_end = heapq.heappop(queue)
            if is_end:
                return _back(index, came)
            if cost > best[index]:
                continue
            if 1 <= index <= self._n_ends:
                heapq.heappush(queue, (cost + float(self._costs[index - 1]), index, True))
            sums = cost + self._lengths[index]
            for after in np.flatnonzero(sums < best):
                best[after] = sums[after]
                came[int(after)] = index
                heapq.heappush(queue, (float(sums[after]), int(after), False))
        return None

    def _shortened(self, path: list[int]) -> list[Move]:
        """The movements of a way, without the detours that can be left out."""
        moves: list[Move] = []
        at = 0
        while at < len(path) - 1:
            after = at + 1
            for later in range(len(path) - 1, at + 1, -1):
                ways = self._edge(path[at], path[later])
                if ways is not None and len(ways) <= sum(
                    len(self._ways[e] or ()) for e in itertools.pairwise(path[at : later + 1])
                ):
                    after = later
                    break
            moves += self._edge(path[at], path[after]) or ()
            at = after
        return moves


def _back(index: int, came: dict[int, int]) -> list[int]:
    path = [index]
    while path[-1] in came and path[-1] != 0:
        path.append(came[path[-1]])
    return path[::-1]


def first_of(now: Poses, move: Move) -> Poses:
    """The next pose (1) on a movement that was stopped at the present one."""
    spans = _spans(now, move.pose, _sizes(now, move.pose)[:, 0])
    ((_, stances),) = _moves(now, (move.kind,), spans)
    return stances[:1]
