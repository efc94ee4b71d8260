"""Putting down what an arm holds: the way to a place, and what is learnt from what it meets on that."""

from collections.abc import Iterator, Sequence

import numpy as np

from infthor_eval.manipulation.candidates import Goal, ends_of, passed
from infthor_eval.manipulation.conversion import Call
from infthor_eval.manipulation.environment import ArmEnvironment, arm_of
from infthor_eval.manipulation.geometry import xyz
from infthor_eval.manipulation.linkage import Linkage, angles_of
from infthor_eval.manipulation.roadmap import Contact, Kind, Move, Roadmap, Terrain, first_of
from infthor_eval.manipulation.stand import Stand
from infthor_eval.manipulation.surroundings import Belief, Surroundings

__all__ = ["put"]

_PLANS = 40  # until it gives up
_EXACT, _LEVEL = 0.015, 0.03  # metres, and of what rotations consist of: a pose that was come to
# What is believed when a way is sought, one after the other until one is found, and how many poses are drawn for it.
_ATTEMPTS = (
    (Belief.WHOLE, 200), (Belief.FILLED, 200), (Belief.MET, 200), (Belief.RECEPTACLE, 500), (Belief.NOTHING, 200)
)  # fmt: skip

Steps = Iterator[Sequence[Call]]


def put(environment: ArmEnvironment) -> Steps:
    """Bring what is held over a place, and let go of it there; where something is met, seek another way."""
    task = _Putting(environment)
    for _ in range(_PLANS):
        moves = task.moves()
        if moves is None:
            if not task.forget():
                return
            continue
        for move in moves:
            yield [task.call(move)]
            if not task.came_to(move):
                break
        else:
            yield [{"action": "ReleaseObject"}]


class _Putting:
    """What is known of one put."""

    def __init__(self, environment: ArmEnvironment) -> None:
        self._environment = environment
        self._random = np.random.default_rng(0)
        self._stand = Stand.of(environment.view.agent)
        self._first: Linkage | None = None
        self._first = self._linkage = self._measured()
        self._contacts: list[Contact] = []
        self._surroundings = Surroundings(environment, self._linkage, self._stand.floor)

    def moves(self) -> list[Move] | None:
        """A way from the present pose to one in which to let go; None where none is found."""
        goal = self._goal()
        if goal is None:
            return None
        self._linkage = self._measured()
        for belief, count in _ATTEMPTS:
            solids = self._surroundings.solids(belief)
            terrain = Terrain(self._linkage, solids, self._contacts, escapes=belief <= Belief.MET)
            ends = ends_of(goal, terrain, self._stand, self._random)
            if not len(ends.poses):
                continue
            others = passed(goal, terrain, self._stand, ends.poses, count, self._random)
            found = Roadmap(terrain, others, ends.poses, ends.costs).way()
            if found is not None:
                return found
        return None

    def call(self, move: Move) -> Call:
        """A movement as AI2-THOR takes it."""
        if move.kind == Kind.LIFT:
            return {"action": "MoveArmBase", "y": self._stand.share(float(move.pose.bases[0])), "returnToStart": False}
        if move.kind == Kind.REACH:
            x, y, z = move.pose.world()[0].tolist()
            return {"action": "MoveArm", "position": xyz((x, y, z)), "coordinateSpace": "world", "returnToStart": False}
        pitch, yaw, roll = angles_of(self._linkage.now.turns[0].T @ move.pose.turns[0])
        return {"action": "RotateWristRelative", "pitch": pitch, "yaw": yaw, "roll": roll, "returnToStart": False}

    def came_to(self, move: Move) -> bool:
        """Whether the arm is where a movement was to bring it; if something was met, that is remembered."""
        self._linkage = self._measured()
        now = self._linkage.now
        view = self._environment.view
        if not view.success:
            met = first_of(now, move)
            parts = self._linkage.parts(met)
            on_goal = self._surroundings.met(parts, view.error)
            self._contacts.append(Contact(met.world()[0], parts.center[0, -1], on_goal))
            return False
        exact = np.abs(now.world() - move.pose.world()).max() < _EXACT
        return bool(exact and np.abs(now.turns - move.pose.turns).max() < _LEVEL)

    def forget(self) -> bool:
        """Forget what was met before, which may leave no way; whether there was anything."""
        known = bool(self._contacts)
        self._contacts.clear()
        return known

    def _goal(self) -> Goal | None:
        """None where the receptacle has no places."""
        around = self._surroundings
        return None if around.places is None else Goal(around.places, around.entry, around.others())

    def _measured(self) -> Linkage:
        view = self._environment.view
        return Linkage(arm_of(view), view.objects[self._environment.moment.object_id], self._first)
