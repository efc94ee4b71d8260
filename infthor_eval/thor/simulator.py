"""The simulator as the other rooms use it: scenes, actions, views, and survival of its process.

Every action since the last scene change is kept. When the process dies, hangs or talks nonsense, a fresh one
is started and the episode so far is run again, action for action; the caller sees nothing but the delay. That
holds as far as the simulator is deterministic, so each repeated action must end as it did before.
"""

import logging
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self

from infthor_eval.errors import SceneError, SimulatorError
from infthor_eval.thor.controller import SafeController
from infthor_eval.thor.launch import Launch
from infthor_eval.thor.teleport import teleport_call
from infthor_eval.thor.transport import PeerFault
from infthor_eval.thor.view import SimulatorView, view_of

__all__ = ["Simulator", "SimulatorMark"]

_Done = tuple[dict[str, Any], bool]  # a call, and whether it was carried out
_LOG = logging.getLogger(__name__)
_INITIAL = {"gridSize": 0.25, "fieldOfView": 60, "visibilityDistance": 1.5, "snapToGrid": True}
_UNSEEN = {"renderImage": False, "renderInstanceSegmentation": False, "renderDepthImage": False}
_WALKING = {"MoveAhead", "MoveBack", "MoveLeft", "MoveRight", "RotateLeft", "RotateRight", "LookUp", "LookDown"}


@dataclass(frozen=True, eq=False)
class SimulatorMark:
    """A moment since the scene was loaded: the actions that led to it, and the world then."""

    episode: tuple["_Done", ...]
    view: SimulatorView


class Simulator:
    """One simulator process, kept alive. Use it as a context manager.

    Attributes:
        view: the world after the last action.
        restarts: how often a fresh process had to be started so far.
    """

    def __init__(
        self,
        launch: Launch,
        *,
        width: int = 300,
        height: int = 300,
        image: bool = True,
        instances: bool = True,
        depth: bool = False,
        max_restarts: int = 3,
        max_copies: int = 2,
        **options: Any,
    ) -> None:
        """Describe the simulator; it starts with the first `reset`.

        Args:
            launch: what to start.
            width: of the frames, pixels.
            height: of the frames, pixels.
            image: whether views after actions have a frame; half of an action's time is spent on it.
            instances: whether views tell which object each pixel shows.
            depth: whether views have depth.
            max_restarts: how many failures one episode may survive from one mark to the next.
            max_copies: of how many marks the embedded simulator keeps a copy of its state (0.2 MB each).
            options: further initialisation parameters of AI2-THOR (`fieldOfView`, `agentMode`, ...).
        """
        self._launch = launch
        self._options = {
            **_INITIAL,
            "width": width,
            "height": height,
            "renderInstanceSegmentation": instances,
            "renderDepthImage": depth,
            **options,
        }
        self._unseen = {} if image else {"renderImage": False}
        self._max_restarts = max_restarts
        self._max_copies = max_copies
        self._controller: SafeController | None = None
        self._scene: str | dict[str, Any] | None = None
        self._episode: list[_Done] = []
        self._failures = 0
        self._copies: dict[SimulatorMark, int] = {}  # to the slot of the process's copy; the longest unused first
        self._view: SimulatorView | None = None
        self.restarts = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, error_type: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def label(self) -> str:
        """Which simulator this is, "embedded" or "unity"."""
        return self._launch.label

    @property
    def view(self) -> SimulatorView:
        """The world after the last action.

        Raises:
            SimulatorError: no scene is loaded.
        """
        if self._view is None:
            raise SimulatorError("no scene is loaded; reset the simulator to one first")
        return self._view

    @property
    def metadata(self) -> dict[str, Any]:
        """The simulator's last reply as it came, with all its fields; `view` is the typed part of it.

        Raises:
            SimulatorError: no scene is loaded.
        """
        if self._controller is None or self._controller.last_event is None:
            raise SimulatorError("no scene is loaded; reset the simulator to one first")
        return dict(self._controller.last_event.metadata)

    def reset(self, scene: str | dict[str, Any] | None) -> SimulatorView:
        """Load a scene and begin an episode.

        Args:
            scene: its name (`FloorPlan10`, `kitchen-3`), the description of a ProcTHOR house, or None for the
                present one.

        Raises:
            SceneError: the simulator refuses the scene.
            SimulatorError: it cannot be started.
        """
        self._scene, self._episode, self._failures = scene or self._scene, [], 0
        self._copies = {}
        while True:
            try:
                self._view = self._load()
                return self._view
            except PeerFault as fault:
                self._recover_from(fault)

    def step(self, action: str, **arguments: Any) -> SimulatorView:
        """Run one action; a refused one is told by the view's `success` and `error`.

        Raises:
            SimulatorError: the simulator failed more often than it may, or a repeated episode went another
                way.
        """
        call = {"action": action, **arguments}
        while True:
            try:
                if self._controller is None:
                    self._repeat_episode()
                view = self._call(call)
            except PeerFault as fault:
                self._recover_from(fault)
            else:
                self._episode.append((call, view.success))
                self._view = view
                return view

    def query(self, action: str, **arguments: Any) -> SimulatorView:
        """Run an action that only asks (`GetReachablePositions`): it is no part of the episode, nor is its
        view kept.

        Raises:
            SimulatorError: as `step`.
        """
        before, length = self._view, len(self._episode)
        answer = self.step(action, **arguments)
        del self._episode[length:]
        self._view = before
        return answer

    def mark(self) -> SimulatorMark:
        """Remember this moment, for `rewind`; of marks that were not used for long the simulator keeps no copy.

        The embedded simulator keeps a copy of its state. Unity cannot: there `rewind` may repeat the episode.
        """
        latest = next(reversed(self._copies), None)
        if latest is not None and self._is_at(latest):
            return latest
        mark = SimulatorMark(tuple(self._episode), self.view)
        self._copy(mark)
        self._failures = 0  # the episode has come on
        return mark

    def rewind(self, mark: SimulatorMark, *, exactly: bool = False) -> SimulatorView:
        """Bring the world to where it was at a mark, behind or beside the present moment, of the scene loaded.

        Args:
            mark: where to.
            exactly: whether it matters that walking back is off by the rounding errors of the steps, and single
                pixels with it; else an agent that only walked since is put back, which is faster.

        Raises:
            SimulatorError: as `step`.
        """
        there = self._is_at(mark) or (not exactly and self._walk_back(mark)) or self._restore(mark)
        if not there:
            self.reset(None)
            for call, _ in mark.episode:
                self.step(**call)
            self._copy(mark)
            return self.view
        self._episode = list(mark.episode)
        self._view = mark.view
        return mark.view

    def _is_at(self, mark: SimulatorMark) -> bool:
        return len(self._episode) == len(mark.episode) and self._began_with(mark)

    def _began_with(self, mark: SimulatorMark) -> bool:
        return tuple(self._episode[: len(mark.episode)]) == mark.episode

    def _copy(self, mark: SimulatorMark) -> None:
        """Have the process keep a copy of the present state, which is the mark's."""
        if len(self._copies) == self._max_copies:
            self._copies.pop(next(iter(self._copies)))
        slot = min(set(range(self._max_copies)) - set(self._copies.values()))
        if self.query("SaveState", slot=slot).success:
            self._copies[mark] = slot

    def _restore(self, mark: SimulatorMark) -> bool:
        slot = self._copies.pop(mark, None)
        if slot is None or not self.query("RestoreState", slot=slot, **_UNSEEN).success:
            return False
        self._copies[mark] = slot  # the last one used
        return True

    def _walk_back(self, mark: SimulatorMark) -> bool:
        """Put the agent where it was, where it only walked and looked about since."""
        since = self._episode[len(mark.episode) :]
        if not self._began_with(mark) or any(call["action"] not in _WALKING for call, _ in since):
            return False
        back = self.query(**teleport_call(mark.view.agent))
        return back.success and back.agent == mark.view.agent

    def close(self) -> None:
        """Stop the simulator; a later `reset` starts it again."""
        self._copies = {}
        if self._controller is not None:
            self._controller.stop()
            self._controller = None

    def _load(self) -> SimulatorView:
        """Bring the process to the start of the episode, starting one if need be."""
        if self._scene is None:
            raise SimulatorError("no scene is loaded; reset the simulator to one first")
        if self._controller is None:
            self._controller = SafeController(self._launch, self._scene, **self._options)
            return view_of(self._controller.last_event)
        try:
            return view_of(self._controller.reset(self._scene))
        except (ValueError, RuntimeError) as error:
            message = " ".join(str(error).split())[:300]
            raise SceneError(f"scene {self._scene}: {message}") from error

    def _call(self, call: dict[str, Any]) -> SimulatorView:
        assert self._controller is not None
        try:
            return view_of(self._controller.step({**self._unseen, **call}))
        except ValueError:
            # ai2thor raises it for unknown actions and arguments; the reply is kept and says so itself.
            return view_of(self._controller.last_event)

    def _repeat_episode(self) -> None:
        self._load()
        for index, (call, success) in enumerate(self._episode):
            if self._call(call).success != success:
                raise SimulatorError(
                    f"after a restart action {index} ({call['action']}) of the episode in {self._scene} "
                    "ended otherwise than before; run the episode again from its start"
                )

    def _recover_from(self, fault: PeerFault) -> None:
        """Drop the failed process; raise where it failed too often."""
        self.close()
        self._failures += 1
        if self._failures > self._max_restarts:
            raise SimulatorError(f"{fault} (failure {self._failures} since the last mark, giving up)") from fault
        self.restarts += 1
        _LOG.warning("%s; starting it again (%d of %d)", fault, self._failures, self._max_restarts)
