"""Path planning of an arm among obstacles, by a lazy probabilistic roadmap.

Free poses are drawn at random, and each is joined to its nearest neighbours. The search takes the
cheapest path by the costs of its edges and tests edges for collisions only on that path, as the
tests are what takes the time. An edge that collides is removed, edges near the collision become
dearer, and the search begins again.
"""

import heapq
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from infthor_eval.manipulation.planner.linkage import Array, Linkage, Poses, rotations_about
from infthor_eval.manipulation.planner.obstacles import Obstacles, clearances

# metres and radians between two poses of a movement that are tested
_STEP = 0.03
_ANGLE = math.radians(5.0)
_MARGIN = 0.01  # metres that are kept from obstacles
_STUCK = 0.02  # metres of overlap with the arm from which a thing's box cannot be right
_NEAR = 0.05  # metres around a contact of the hand and the held object that are not tried again
_NEIGHBOURS = 14  # of a pose in the roadmap
_GLANCE = 3  # every third pose of a movement is tested first: most collisions show there
# cost in metres that is added to edges within so many metres of a collision
_HARD = 0.15
_CLOSE = 0.12
_LEARNT = 3  # colliding poses of each edge that this is done for
_MAX_SEARCHES = 150
_SAME = 1e-3  # metres and radians within which poses are equal: simulators round
# costs in metres: of a movement, a metre of the base, and a radian
_MOVE = 0.15
_BASE = 0.5
_TURN = 0.25
_MAX_LENGTH = 2.0  # cost above which edges are left out
_MAX_TURN = math.radians(170.0)  # nearly half a turn, whose direction depends on rounding


@dataclass(frozen=True)
class Contact:
    """A collision of the arm.

    Attributes:
        wrist: position of the wrist, metres (3,).
        held: position of the middle of the held object.
        on_goal: whether it was with the receptacle that the object is to be put into.
    """

    wrist: Array
    held: Array
    on_goal: bool = False


class MoveKind(IntEnum):
    """Kinds of movement: base up or down, wrist in a straight line, hand about the wrist."""

    LIFT = 0
    REACH = 1
    TURN = 2


@dataclass(frozen=True)
class ArmMove:
    """One movement of an arm, and the pose (1) after it."""

    kind: MoveKind
    pose: Poses


_Stretch = tuple[MoveKind, Poses]  # the kind of a movement and the poses (n) on its path


class Terrain:
    """Which movements are free for an arm (`linkage`, as it is now), given its collisions."""

    def __init__(
        self,
        linkage: Linkage,
        obstacles: Obstacles,
        contacts: Sequence[Contact],
        *,
        escapes: bool = False,
    ) -> None:
        """Measure how near obstacles are in the present pose.

        Args:
            escapes: whether a part that is deep in a thing may leave it through other parts of that
                thing, as the embedded simulator allows; in Unity it is stuck.
        """
        self._deepest = -_STUCK if escapes else -np.inf
        self.linkage = linkage
        self._obstacles = obstacles
        self.contacts = contacts
        self._least = _tolerance(self._clearances(linkage.now)[0])
        self._start = self._from_contacts(linkage.now)

    def free(self, poses: Poses) -> NDArray[np.bool_]:
        """Return whether poses (n,) are free; the arm may be as deep in a thing as it is now.

        Boxes are larger than the things that they stand for, so the present pose may be in one.
        """
        clear = self.linkage.can_reach(poses)
        if clear.any():
            clear[clear] = (self._clearances(poses[clear]) >= self._least).all(axis=(1, 2))
        return clear & (self._from_contacts(poses) >= _NEAR).all(axis=1)

    def movements(self, start: Poses, end: Poses) -> tuple[list[ArmMove] | None, Poses]:
        """Find free movements from one pose (1) to another, at most one of each kind, in any order.

        Returns:
            The movements, None if there are none; then also the first colliding poses (n) of each
            order.
        """
        sizes = _sizes(start, end)[:, 0]
        if sizes[MoveKind.TURN] > _MAX_TURN:
            return None, end[:0]
        kinds = [kind for kind in MoveKind if sizes[kind] > _SAME]
        if not kinds:
            return [], end[:0]
        spans = _spans(start, end, sizes)
        orders = [list(_moves(start, order, spans)) for order in itertools.permutations(kinds)]
        leaving = start is self.linkage.now
        promising, collisions = self._promising_orders(orders, leaving=leaving)
        for moves in promising:
            path = [stances for _, stances in moves]
            blocked = self._first_collision(start, path, leaving=leaving)
            if blocked is None:
                return [ArmMove(kind, stances[-1:]) for kind, stances in moves], end[:0]
            collisions.append(blocked)
        return None, Poses.join(collisions)

    def _promising_orders(
        self, orders: list[list[_Stretch]], *, leaving: bool
    ) -> tuple[list[list[_Stretch]], list[Poses]]:
        """Return orders of which a few poses are free, and the first colliding pose of the others.

        All orders are tested in one call: numpy's overhead is large for so few poses.
        """
        glances = list(map(_glance, orders))
        poses = Poses.join(glances)
        least = self._least
        if leaving:
            least = np.where(least < self._deepest, -np.inf, least)
        clear = (self._clearances(poses) >= least).all(axis=(1, 2))
        ends = np.cumsum([len(part) for part in glances])[:-1]
        promising: list[list[_Stretch]] = []
        collisions: list[Poses] = []
        for moves, part, seen in zip(orders, glances, np.split(clear, ends), strict=True):
            if seen.all():
                promising.append(moves)
            else:
                first = int(np.argmin(seen))
                collisions.append(part[first : first + 1])
        return promising, collisions

    def _first_collision(self, start: Poses, moves: list[Poses], *, leaving: bool) -> Poses | None:
        """Return the first colliding pose (1) of movements in order; None if they are free.

        A part that touches a thing at the start of a movement may not get deeper into it. A part
        that is in a thing may leave it through other parts of it, if escapes are allowed.
        """
        path = Poses.join([start, *moves])
        least = np.minimum(_NEAR, self._start - _SAME) if leaving else _NEAR
        bad = ~self.linkage.can_reach(path) | (self._from_contacts(path) < least).any(axis=1)
        clearance = self._clearances(path)
        first = 0
        for move in moves:
            last = first + len(move)
            lowest = _tolerance(clearance[first])
            on_the_way = np.where(lowest < self._deepest, -np.inf, lowest)
            bad[first + 1 : last] |= (clearance[first + 1 : last] < on_the_way).any(axis=(1, 2))
            bad[last] |= bool((clearance[last] < lowest).any())
            first = last
        bad[0] = False
        return path[np.flatnonzero(bad)[:1]] if bad.any() else None

    def _clearances(self, poses: Poses) -> Array:
        """Return how far (n, parts, things) the arm's parts are from things."""
        return clearances(self.linkage.parts(poses), self._obstacles)

    def _from_contacts(self, poses: Poses) -> Array:
        """Return how far (n, contacts) poses are from earlier collisions, metres."""
        if not self.contacts:
            return np.zeros((len(poses), 0))
        wrists = poses.world()
        held = self.linkage.held_box(poses).center[:, 0]
        apart = []
        for contact in self.contacts:
            to_wrist = np.linalg.norm(wrists - contact.wrist, axis=1)
            to_held = np.linalg.norm(held - contact.held, axis=1)
            apart.append(np.maximum(to_wrist, to_held))
        return np.stack(apart, axis=1)


def _glance(moves: list[_Stretch]) -> Poses:
    """Return a few poses of some movements, with the last of each."""
    return Poses.join([stances[::-_GLANCE][::-1] for _, stances in moves])


def _tolerance(clearance: Array) -> Array:
    """Return how near (or deep) parts may come to things, given the clearance at the start."""
    tolerated: Array = np.minimum(_MARGIN, clearance - _SAME)
    return tolerated


def _moves(start: Poses, order: Sequence[MoveKind], spans: Sequence[Array]) -> Iterator[_Stretch]:
    """Yield each movement of an order with its poses (n); `spans` has what each kind changes."""
    done = {MoveKind.LIFT: start.bases, MoveKind.REACH: start.wrists, MoveKind.TURN: start.turns}
    for kind in order:
        count = len(spans[kind])
        values = {k: spans[k] if k == kind else np.repeat(done[k], count, axis=0) for k in done}
        stances = Poses(values[MoveKind.REACH], values[MoveKind.LIFT], values[MoveKind.TURN])
        yield kind, stances
        done[kind] = spans[kind][-1:]


def _spans(start: Poses, end: Poses, sizes: Array) -> list[Array]:
    """Return what each kind of movement changes from one pose (1) to another, step by step."""
    shares = [
        np.linspace(0.0, 1.0, max(1, math.ceil(float(size) / step)) + 1)[1:]
        for size, step in zip(sizes, (_STEP, _STEP, _ANGLE), strict=True)
    ]
    bases = start.bases + shares[0] * (end.bases - start.bases)
    wrists = start.wrists + shares[1][:, None] * (end.wrists - start.wrists)
    return [bases, wrists, _interpolate_rotations(start.turns[0], end.turns[0], shares[2])]


def _sizes(start: Poses, end: Poses) -> Array:
    """Return how far (3, n) poses are from others: metres of base and wrist, radians."""
    cosine = (np.einsum("nij,nij->n", start.turns, end.turns) - 1.0) / 2.0
    return np.stack([
        np.abs(end.bases - start.bases), np.linalg.norm(end.wrists - start.wrists, axis=1),
        np.arccos(np.clip(cosine, -1.0, 1.0)),
    ])  # fmt: skip


def _interpolate_rotations(start: Array, end: Array, shares: Array) -> Array:
    """Return rotations (n, 3, 3) on the shortest path from one to another."""
    turn = start.T @ end
    skew = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine = float(np.linalg.norm(skew))
    angle = math.atan2(sine, float(np.trace(turn)) - 1.0)
    rotations: Array = start @ rotations_about(skew / max(sine, 1e-9), shares * angle)
    rotations[-1] = end  # exactly, without the rounding of the axis
    return rotations


class Roadmap:
    """Free poses, and the costs of moving from one to another."""

    def __init__(self, terrain: Terrain, others: Poses, ends: Poses, costs: Array) -> None:
        """Collect the poses that may be passed (n), and those to reach (m), with costs (m,)."""
        self._terrain = terrain
        self._costs = costs
        self._poses = Poses.join([terrain.linkage.now, ends, others])
        self._n_ends = len(ends)
        self._movements: dict[tuple[int, int], list[ArmMove] | None] = {}
        self._lengths = self._edge_costs()
        self._edges = np.nonzero(np.isfinite(self._lengths))
        spots = self._spots_of(self._poses)
        self._edge_starts = spots[self._edges[0]]
        self._edge_lines = spots[self._edges[1]] - spots[self._edges[0]]
        self._squared_lengths = np.maximum((self._edge_lines**2).sum(axis=1), _SAME)

    def _edge_costs(self) -> Array:
        """Return the costs (n, n) of moving between poses; infinite if they are not joined."""
        p = self._poses
        count = len(p)
        wide = np.linalg.norm(p.wrists[:, None] - p.wrists[None], axis=2)
        high = np.abs(p.bases[:, None] - p.bases[None])
        flat = p.turns.reshape(count, 9)
        angle = np.arccos(np.clip((flat @ flat.T - 1.0) / 2.0, -1.0, 1.0))
        lengths = wide + _BASE * high + _TURN * angle
        lengths += _MOVE * ((wide > _SAME) + (high > _SAME) * 1.0 + (angle > _SAME))
        lengths[(lengths > _MAX_LENGTH) | (angle > _MAX_TURN)] = np.inf
        np.fill_diagonal(lengths, np.inf)
        nearest = np.argsort(lengths, axis=1)[:, _NEIGHBOURS:]
        kept = np.ones_like(lengths, dtype=bool)
        np.put_along_axis(kept, nearest, values=False, axis=1)
        # The present pose is joined to all ends: a direct path is the best.
        kept[0, : 1 + self._n_ends] = True
        lengths[~(kept | kept.T)] = np.inf
        return lengths

    def find_path(self) -> list[ArmMove] | None:
        """Return the cheapest free path; None if none is found."""
        for _ in range(_MAX_SEARCHES):
            path = self._cheapest()
            if path is None:
                return None
            edges = itertools.pairwise(path)
            blocked = next((edge for edge in edges if self._edge(*edge) is None), None)
            if blocked is None:
                return self._shorten(path)
            self._lengths[blocked] = self._lengths[blocked[::-1]] = np.inf
        return None

    def _edge(self, start: int, end: int) -> list[ArmMove] | None:
        if (start, end) not in self._movements:
            self._movements[start, end], collisions = self._terrain.movements(
                self._pose(start), self._pose(end)
            )
            self._learn(collisions)
        return self._movements[start, end]

    def _learn(self, collisions: Poses) -> None:
        """Make edges near colliding poses dearer: they are likely to collide too."""
        starts, ends = self._edges
        for spot in self._spots_of(collisions[:_LEARNT]):
            apart = spot - self._edge_starts
            share = np.clip(
                np.einsum("ij,ij->i", apart, self._edge_lines) / self._squared_lengths, 0.0, 1.0
            )
            apart -= share[:, None] * self._edge_lines
            near = np.einsum("ij,ij->i", apart, apart) < _CLOSE**2
            self._lengths[starts[near], ends[near]] += _HARD

    def _spots_of(self, poses: Poses) -> Array:
        """Return the positions (n, 6) of the wrist and the held object's middle, metres."""
        held = self._terrain.linkage.held_box(poses)
        return np.concatenate([poses.world(), held.center[:, 0]], axis=1)

    def _pose(self, index: int) -> Poses:
        # `Terrain` knows the present pose by identity, see `leaving`.
        return self._poses[index : index + 1] if index else self._terrain.linkage.now

    def _cheapest(self) -> list[int] | None:
        """Return the cheapest path by the present costs (Dijkstra), as indices of poses."""
        best = np.full(len(self._poses), np.inf)
        best[0] = 0.0
        came: dict[int, int] = {}
        queue: list[tuple[float, int, bool]] = [(0.0, 0, False)]
        while queue:
            cost, index, is_end = heapq.heappop(queue)
            if is_end:
                return _trace_back(index, came)
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

    def _shorten(self, path: list[int]) -> list[ArmMove]:
        """Return the movements of a path, without detours that can be skipped."""
        moves: list[ArmMove] = []
        at = 0
        while at < len(path) - 1:
            after = at + 1
            for later in range(len(path) - 1, at + 1, -1):
                moves_between = self._edge(path[at], path[later])
                edges = itertools.pairwise(path[at : later + 1])
                n_moves = sum(len(self._movements[edge] or ()) for edge in edges)
                if moves_between is not None and len(moves_between) <= n_moves:
                    after = later
                    break
            moves += self._edge(path[at], path[after]) or ()
            at = after
        return moves


def _trace_back(index: int, came: dict[int, int]) -> list[int]:
    path = [index]
    while path[-1] in came and path[-1] != 0:
        path.append(came[path[-1]])
    return path[::-1]


def first_pose_of(now: Poses, move: ArmMove) -> Poses:
    """Return the next pose (1) of a movement that was stopped at the present one."""
    spans = _spans(now, move.pose, _sizes(now, move.pose)[:, 0])
    ((_, stances),) = _moves(now, (move.kind,), spans)
    return stances[:1]
