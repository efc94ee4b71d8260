"""How a simulator is started: the embedded one, a Unity executable at hand, or AI2-THOR's own downloaded
build."""

import shlex
import sys
from dataclasses import dataclass
from pathlib import Path

__all__ = ["Launch", "embedded", "unity"]


@dataclass(frozen=True)
class Launch:
    """What to start and how long to wait for it.

    Attributes:
        label: "unity" or "embedded": what sets made with it are labelled by.
        executable: command line of the simulator; None for the build that ai2thor downloads.
        platform: name of ai2thor's platform for its own build ("CloudRendering" needs no X server).
        timeout: seconds for one reply.
        start_timeout: seconds until the first message.
    """

    executable: str | None = None
    label: str = "unity"
    platform: str | None = None
    timeout: float = 100.0
    start_timeout: float = 300.0


def embedded(
    data: Path | None = None,
    supplement: Path | None = None,
    *,
    timeout: float = 60.0,
    start_timeout: float = 300.0,
) -> Launch:
    """The simulator that comes with this package.

    Args:
        data: folder with recorded floor plans; without it only procedural scenes exist.
        supplement: file with what the trajectories at hand tell of the floor plans beside it.
        timeout: seconds for one reply.
        start_timeout: seconds until the first message. The first start of an installation compiles the renderer, which
            takes ten seconds of a processor; several at once on a busy machine take minutes, and one that is stopped
            in the middle of it would have to begin anew.
    """
    words = [sys.executable, "-m", "infthor_eval.sim"]
    if data is not None:
        words += ["--data", str(Path(data).resolve())]
    if supplement is not None:
        words += ["--supplement", str(Path(supplement).resolve())]
    return Launch(shlex.join(words), "embedded", timeout=timeout, start_timeout=start_timeout)


def unity(executable: Path | None = None, *, platform: str | None = None) -> Launch:
    """A Unity build of AI2-THOR: an executable at hand, or the build that ai2thor downloads itself."""
    return Launch(None if executable is None else shlex.quote(str(executable)), platform=platform)
