"""Simulator processes for episodes that run at the same time: one each, used again."""

import weakref
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.thor import launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.supplement import supplement_file

_COPIES = 512  # of the simulator's state: one for each plan of a long trajectory


class Simulators:
    """Starts simulators as they are needed, and stops them at `close` or when nobody holds this.

    Attributes:
        is_kept: whether they stay open when a run closes them, for the next one.
    """

    def __init__(
        self, name: str, scenes: Path | None, trajectories: Sequence[Trajectory], **options: Any
    ) -> None:
        """Describe the simulators.

        Args:
            name: "embedded", "unity", or the path of a Unity executable.
            scenes: folder of recorded floor plans, for the embedded one.
            trajectories: trajectories whose objects complete the recorded floor plans.
        """
        self.is_kept = False
        self._options = options
        self._open = ExitStack()
        weakref.finalize(self, self._open.close)
        self._idle: SimpleQueue[Simulator] = SimpleQueue()
        supplement = (
            self._open.enter_context(supplement_file(trajectories)) if scenes is not None else None
        )
        if name == "embedded":
            self._launch = launch.embedded_launch(scenes, supplement)
        else:
            self._launch = launch.unity_launch(None if name == "unity" else Path(name))

    @contextmanager
    def one(self) -> Iterator[Simulator]:
        """Lend a simulator that nobody else has, for as long as the context lasts."""
        try:
            simulator = self._idle.get_nowait()
        except Empty:
            simulator = Simulator(self._launch, max_copies=_COPIES, **self._options)
            self._open.callback(simulator.close)
        try:
            yield simulator
        finally:
            self._idle.put(simulator)

    def close(self) -> None:
        """Stop them all, unless they are kept for another run; safe to call again."""
        if not self.is_kept:
            self._open.close()
