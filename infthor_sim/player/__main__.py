"""`python -m infthor_sim.player [--data DIR] [--supplement FILE] [--controller PID [--files DIR]]
<arguments of a Unity player>`.

The Controller starts this process as if it were Unity and names the pipes in the environment. Of
Unity's own arguments only the screen's size and the quality have an effect.
"""

import ctypes
import os
import shutil
import sys
import time
from argparse import ArgumentParser
from contextlib import closing
from pathlib import Path

from infthor_sim.errors import SimulatorError, UsageError

# GNU's numbers of the options
_M_TRIM_THRESHOLD = -1
_M_MMAP_THRESHOLD = -3
_KEPT = 1 << 25  # bytes; the pictures of one reply have less
_DYING_S = 2.0  # that a process may take to die after its pipes have closed
_POLL_S = 0.01


def main(arguments: list[str] | None = None) -> int:
    """Run the simulator until the controller hangs up; return the exit code."""
    # Both must be set before numba is imported, hence the imports below. OpenMP's threads must not
    # spin between frames: the controller needs the core meanwhile. At most four threads, as several
    # simulators often share a machine.
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
    os.environ.setdefault("NUMBA_NUM_THREADS", str(min(4, os.cpu_count() or 1)))
    from infthor_sim.pictures.views import Display
    from infthor_sim.player.fifo import FifoPipes
    from infthor_sim.player.server import SimulatorServer
    from infthor_sim.scenes.catalogue import Catalogue
    from infthor_sim.settings import SMOOTH_LEVELS
    from infthor_sim.simulation import Simulation

    _tune_malloc()
    parser = ArgumentParser(
        prog="python -m infthor_sim.player",
        description="The embedded simulator that takes the place of AI2-THOR's Unity build",
        add_help=False,
    )
    parser.add_argument("--data", type=Path)
    parser.add_argument("--supplement", type=Path)
    parser.add_argument("--controller", type=int, default=os.getppid())
    parser.add_argument("--files", type=Path)
    parser.add_argument("-screen-width", dest="width", type=int, default=300)
    parser.add_argument("-screen-height", dest="height", type=int, default=300)
    parser.add_argument("-screen-quality", dest="quality", type=int, default=max(SMOOTH_LEVELS))
    options, _ = parser.parse_known_args(arguments)
    try:
        paths = _pipe("AI2THOR_FIFO_SERVER_PIPE_PATH"), _pipe("AI2THOR_FIFO_CLIENT_PIPE_PATH")
        with closing(FifoPipes(*paths, options.controller)) as pipes:
            display = Display(
                options.width, options.height, antialias=options.quality in SMOOTH_LEVELS
            )
            sim = Simulation(Catalogue(options.data, options.supplement), display)
            SimulatorServer(sim).serve(pipes)
    except BrokenPipeError:
        return 0  # the controller went away while a reply was under way
    except SimulatorError as error:
        print(f"infthor_sim.player: {error}", file=sys.stderr)
        return error.exit_code
    finally:
        if options.files is not None:
            _remove_if_orphaned(options.files, options.controller)
    return 0


def _remove_if_orphaned(files: Path, controller: int) -> None:
    """Remove the Controller's temporary folder if it has been killed, and cannot."""
    # The pipes of a killed process close a moment before the system gives its children another
    # parent. One that lives kills this process meanwhile, or removes its files when it ends.
    end = time.monotonic() + _DYING_S
    while os.getppid() == controller:
        if time.monotonic() > end:
            return
        time.sleep(_POLL_S)
    shutil.rmtree(files, ignore_errors=True)


def _tune_malloc() -> None:
    """Have glibc reuse the memory of pictures in place of returning it after each one.

    Getting it again, page by page, takes a tenth of a step. Other C libraries have no such
    setting.
    """
    set_option = getattr(ctypes.CDLL(None), "mallopt", None)
    if set_option is not None:
        set_option(_M_TRIM_THRESHOLD, _KEPT)
        set_option(_M_MMAP_THRESHOLD, _KEPT)


def _pipe(variable: str) -> Path:
    path = os.environ.get(variable)
    if not path:
        raise UsageError(
            f"{variable} is not set: ai2thor's Controller starts this process "
            "(local_executable_path, FIFO server); it cannot be started by hand"
        )
    return Path(path)


if __name__ == "__main__":
    sys.exit(main())
