"""The simulator that all other rooms use: scenes, actions, typed states, recovery from crashes.

All actions since the last scene change are recorded. If the process dies, hangs or breaks the
protocol, a new one is started and the episode is repeated action by action, so that callers notice
only the delay. This requires a deterministic simulator: each repeated action must succeed or fail
as it did before, or the episode ends in an error.
"""

import logging
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self

from infthor_eval.errors import SceneError, SimulatorError
from infthor_eval.thor.controller import SafeController, scene_name
from infthor_eval.thor.launch import Launch
from infthor_eval.thor.transport import PeerFault
from infthor_eval.thor.view import SimulatorView, teleport_call, view_of

_CallResult = tuple[dict[str, Any], bool]  # a call, and whether it succeeded
_LOG = logging.getLogger(__name__)
_INITIAL = {"gridSize": 0.25, "fieldOfView": 60, "visibilityDistance": 1.5, "snapToGrid": True}
NO_RENDERING = {
    "renderImage": False,
    "renderInstanceSegmentation": False,
    "renderDepthImage": False,
}
_WALKING = {
    "MoveAhead",
    "MoveBack",
    "MoveLeft",
    "MoveRight",
    "RotateLeft",
    "RotateRight",
    "LookUp",
    "LookDown",
}


@dataclass(frozen=True, eq=False)
class SimulatorMark:
    """A point of an episode to return to: the actions up to it, and the state there."""

    episode: tuple["_CallResult", ...]
    view: SimulatorView


class Simulator:
    """One simulator process, which is restarted if it fails (`restarts` so far). Use it as a
    context manager."""

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
        """Configure the simulator; the process starts with the first `reset`.

        Args:
            width: width of the frames, pixels.
            height: height of the frames, pixels.
            image: True to render a frame after each action, which takes half of an action's time.
            instances: True to render which object each pixel shows.
            max_restarts: maximum number of restarts from one mark to the next.
            max_copies: number of marks whose state the embedded simulator stores (0.2 MB each).
            options: further initialisation parameters of AI2-THOR (`fieldOfView`, `agentMode`,
                ...).
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
        self._rendering = {} if image else {"renderImage": False}
        self._max_restarts = max_restarts
        self._max_copies = max_copies
        self._controller: SafeController | None = None
        self._scene: str | dict[str, Any] | None = None
        self._episode: list[_CallResult] = []
        self._failures = 0  # since the last mark
        # Slot of the stored state of each mark, the least recently used first.
        self._copies: dict[SimulatorMark, int] = {}
        self._view: SimulatorView | None = None
        self.restarts = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        error_type: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def label(self) -> str:
        """Kind of the simulator, "embedded" or "unity"."""
        return self._launch.label

    @property
    def frames(self) -> int | None:
        """Version of the embedded simulator's drawing; None of another simulator."""
        return self._launch.frames

    @property
    def view(self) -> SimulatorView:
        """State after the last action; raises SimulatorError if no scene is loaded."""
        if self._view is None:
            raise SimulatorError("no scene is loaded; reset the simulator to one first")
        return self._view

    @property
    def metadata(self) -> dict[str, Any]:
        """Raw metadata of the last reply (see `view`); SimulatorError if no scene is loaded."""
        if self._controller is None or self._controller.last_event is None:
            raise SimulatorError("no scene is loaded; reset the simulator to one first")
        metadata = self._controller.last_event.metadata
        return {**metadata, "objects": metadata["objects"].whole()}

    def reset(self, scene: str | dict[str, Any] | None) -> SimulatorView:
        """Load a scene and begin an episode.

        Args:
            scene: name of the scene (`FloorPlan10`, `kitchen-3`), description of a ProcTHOR house,
                or None for the current scene.
        """
        self._scene = scene or self._scene
        self._episode = []
        self._failures = 0
        self._copies = {}
        while True:
            try:
                self._view = self._load()
                return self._view
            except PeerFault as fault:
                self._recover_from(fault)

    def step(self, action: str, **arguments: Any) -> SimulatorView:
        """Run an action and return the state after it; `success` and `error` show a refusal."""
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
        """Run an action without lasting effect (`GetReachablePositions`) outside the episode;
        raises as `step` does."""
        view = self._view
        length = len(self._episode)
        reply = self.step(action, **arguments)
        del self._episode[length:]
        self._view = view
        return reply

    def mark(self) -> SimulatorMark:
        """Mark the current state for `rewind`.

        The embedded simulator stores its state, for the `max_copies` marks that were used last.
        Unity cannot, so that `rewind` may have to repeat the episode there.
        """
        latest = next(reversed(self._copies), None)
        if latest is not None and self._is_at(latest):
            return latest
        mark = SimulatorMark(tuple(self._episode), self.view)
        self._copy(mark)
        self._failures = 0  # the episode made progress since the last failure
        return mark

    def stores(self, mark: SimulatorMark) -> bool:
        """Return True if a mark's state is stored, so that `rewind` repeats no episode."""
        return mark in self._copies

    def rewind(self, mark: SimulatorMark, *, exactly: bool = False) -> SimulatorView:
        """Return to the state at a mark of this scene, in the current episode's past or not.

        Args:
            mark: the mark.
            exactly: True to restore the state bit by bit. If False, an agent that only walked since
                the mark is teleported back, which is faster, but can differ by rounding errors and
                hence by single pixels.
        """
        done = self._is_at(mark) or (not exactly and self._walk_back(mark)) or self._restore(mark)
        if not done:
            self.reset(None)
            for call, _ in mark.episode:
                self.step(**call)
            self._copy(mark)
            return self.view
        self._episode = list(mark.episode)
        self._view = mark.view
        return mark.view

    def _is_at(self, mark: SimulatorMark) -> bool:
        return len(self._episode) == len(mark.episode) and self._starts_with(mark)

    def _starts_with(self, mark: SimulatorMark) -> bool:
        return tuple(self._episode[: len(mark.episode)]) == mark.episode

    def _copy(self, mark: SimulatorMark) -> None:
        """Let the process store its current state, which is that of the mark."""
        if len(self._copies) == self._max_copies:
            self._copies.pop(next(iter(self._copies)))
        slot = min(set(range(self._max_copies)) - set(self._copies.values()))
        if self.query("SaveState", slot=slot).success:
            self._copies[mark] = slot

    def _restore(self, mark: SimulatorMark) -> bool:
        slot = self._copies.pop(mark, None)
        if slot is None or not self.query("RestoreState", slot=slot, **NO_RENDERING).success:
            return False
        self._copies[mark] = slot  # now the most recently used one
        return True

    def _walk_back(self, mark: SimulatorMark) -> bool:
        """Teleport the agent to its pose at the mark, if it only walked and looked around since."""
        since = self._episode[len(mark.episode) :]
        if not self._starts_with(mark) or any(call["action"] not in _WALKING for call, _ in since):
            return False
        view = self.query(**teleport_call(mark.view.agent))
        return view.success and view.agent == mark.view.agent

    def close(self) -> None:
        """Stop the simulator; a later `reset` starts it again."""
        self._copies = {}
        if self._controller is not None:
            self._controller.stop()
            self._controller = None

    def _load(self) -> SimulatorView:
        """Load the scene, in a new process if there is none."""
        if self._scene is None:
            raise SimulatorError("no scene is loaded; reset the simulator to one first")
        if self._controller is None:
            self._controller = SafeController(self._launch, self._scene, **self._options)
            return view_of(self._controller.last_event)
        try:
            return view_of(self._controller.reset(self._scene))
        except (ValueError, RuntimeError) as error:
            message = " ".join(str(error).split())[:300]
            raise SceneError(f"scene {scene_name(self._scene)}: {message}") from error

    def _call(self, call: dict[str, Any]) -> SimulatorView:
        assert self._controller is not None
        try:
            return view_of(self._controller.step({**self._rendering, **call}))
        except ValueError:
            # ai2thor raises this for unknown actions and arguments, after it stored the reply that
            # refuses them.
            return view_of(self._controller.last_event)

    def _repeat_episode(self) -> None:
        self._load()
        for index, (call, success) in enumerate(self._episode):
            if self._call(call).success != success:
                raise SimulatorError(
                    f"after a restart action {index} ({call['action']}) of the episode in "
                    f"{scene_name(self._scene)} ended differently than before; run the episode "
                    "again from its start"
                )

    def _recover_from(self, fault: PeerFault) -> None:
        """Stop the failed process; raise if it failed too often."""
        self.close()
        self._failures += 1
        if self._failures > self._max_restarts:
            hint = (
                f"; {self._launch.timeout_hint}"
                if fault.fault_type == "hung" and self._launch.timeout_hint
                else ""
            )
            message = f"{fault} (failure {self._failures} since the last mark, giving up){hint}"
            raise SimulatorError(message) from fault
        self.restarts += 1
        _LOG.warning("%s; starting it again (%d of %d)", fault, self._failures, self._max_restarts)
