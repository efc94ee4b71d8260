"""Putting down a held object: paths to a place, and what collisions tell of the surroundings."""

from collections.abc import Iterator, Sequence

import numpy as np

from infthor_eval.manipulation.conversion import Call
from infthor_eval.manipulation.environment import ArmEnvironment, arm_of
from infthor_eval.manipulation.geometry import xyz
from infthor_eval.manipulation.planner.candidates import PutGoal, passing_poses, release_poses
from infthor_eval.manipulation.planner.linkage import ArmStand, Linkage, angles_of
from infthor_eval.manipulation.planner.roadmap import (
    ArmMove,
    Contact,
    MoveKind,
    Roadmap,
    Terrain,
    first_pose_of,
)
from infthor_eval.manipulation.planner.surroundings import Belief, Surroundings

_MAX_PATHS = 40  # after which it gives up
# metres, and entries of rotations, within which a pose is reached
_EXACT = 0.015
_LEVEL = 0.03
# Beliefs about obstacles, tried one after the other until there is a path, and the number of poses
# drawn for each. The metadata's boxes are larger than the things, so with all of them there is
# often no path.
_ATTEMPTS = (
    (Belief.WHOLE, 200), (Belief.FILLED, 200), (Belief.COLLIDED, 200), (Belief.RECEPTACLE, 500),
    (Belief.NOTHING, 200)
)  # fmt: skip

Steps = Iterator[Sequence[Call]]


def put_steps(environment: ArmEnvironment) -> Steps:
    """Yield steps that bring the object over a place and release it; anew after collisions."""
    task = _PutTask(environment)
    for _ in range(_MAX_PATHS):
        moves = task.moves()
        if moves is None:
            if not task.forget():
                return
            continue
        for move in moves:
            yield [task.call(move)]
            if not task.has_reached(move):
                break
        else:
            yield [{"action": "ReleaseObject"}]


class _PutTask:
    """One put, with what is known of its surroundings."""

    def __init__(self, environment: ArmEnvironment) -> None:
        self._environment = environment
        self._random = np.random.default_rng(0)  # the same paths in every run
        self._stand = ArmStand.of(environment.view.agent)
        self._first: Linkage | None = None
        self._first = self._linkage = self._measure()
        self._contacts: list[Contact] = []
        self._surroundings = Surroundings(environment, self._linkage, self._stand.floor)

    def moves(self) -> list[ArmMove] | None:
        """Return a path from the present pose to a release pose; None if none is found."""
        goal = self._goal()
        if goal is None:
            return None
        self._linkage = self._measure()
        for belief, count in _ATTEMPTS:
            obstacles = self._surroundings.obstacles(belief)
            terrain = Terrain(
                self._linkage, obstacles, self._contacts, escapes=belief <= Belief.COLLIDED
            )
            ends = release_poses(goal, terrain, self._stand, self._random)
            if not len(ends.poses):
                continue
            others = passing_poses(goal, terrain, self._stand, ends.poses, count, self._random)
            path = Roadmap(terrain, others, ends.poses, ends.costs).find_path()
            if path is not None:
                return path
        return None

    def call(self, move: ArmMove) -> Call:
        """Return a movement as a call of AI2-THOR's."""
        if move.kind == MoveKind.LIFT:
            return {
                "action": "MoveArmBase",
                "y": self._stand.share(float(move.pose.bases[0])),
                "returnToStart": False,
            }
        if move.kind == MoveKind.REACH:
            x, y, z = move.pose.world()[0].tolist()
            return {
                "action": "MoveArm",
                "position": xyz((x, y, z)),
                "coordinateSpace": "world",
                "returnToStart": False,
            }
        pitch, yaw, roll = angles_of(self._linkage.now.turns[0].T @ move.pose.turns[0])
        return {
            "action": "RotateWristRelative",
            "pitch": pitch,
            "yaw": yaw,
            "roll": roll,
            "returnToStart": False,
        }

    def has_reached(self, move: ArmMove) -> bool:
        """Return whether the arm is where a movement was to bring it; a collision is remembered."""
        self._linkage = self._measure()
        now = self._linkage.now
        view = self._environment.view
        if not view.success:
            pose = first_pose_of(now, move)
            parts = self._linkage.parts(pose)
            on_goal = self._surroundings.add_collision(parts, view.error)
            self._contacts.append(Contact(pose.world()[0], parts.center[0, -1], on_goal))
            return False
        exact = np.abs(now.world() - move.pose.world()).max() < _EXACT
        return bool(exact and np.abs(now.turns - move.pose.turns).max() < _LEVEL)

    def forget(self) -> bool:
        """Forget all collisions, as they may leave no path; return whether there was any."""
        had_contacts = bool(self._contacts)
        self._contacts.clear()
        return had_contacts

    def _goal(self) -> PutGoal | None:
        """Return where to put the object; None if the receptacle has no places."""
        around = self._surroundings
        if around.places is None:
            return None
        return PutGoal(around.places, around.entry, around.others())

    def _measure(self) -> Linkage:
        view = self._environment.view
        return Linkage(arm_of(view), view.objects[self._environment.start.object_id], self._first)
