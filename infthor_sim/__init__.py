"""The embedded simulator: AI2-THOR's Controller without Unity, on a CPU.

`Controller` is ai2thor's own, started on this simulator. `python -m infthor_sim.player` is the
process: it speaks the FIFO protocol of ai2thor 5.0.0, so the unmodified Controller drives it
through `local_executable_path` (`launch.player_command`). Its geometry is calibrated on recordings
of AI2-THOR, its looks are not. The package imports no other of this project.

It differs from Unity on purpose in these points (ACTIONS.md lists all of them by action):

- Nothing rolls or topples, and nothing moves between actions.
- A door that opens is not stopped by the agent, but an open door stops the agent.
- What the agent holds is stopped by the outer walls only while it walks.
- An object has one parent receptacle, the innermost.
- In a recorded floor plan the agent can stand only on the cells of the recording.
- In a recorded floor plan a pick-up may reach what only the coarse box of its open receptacle
  hides. `visible` stays false then.
"""

from typing import TYPE_CHECKING, Any

from infthor_sim.launch import player_command

if TYPE_CHECKING:
    from infthor_sim.controller import Controller

__all__ = ["Controller", "player_command"]


def __getattr__(name: str) -> Any:
    # Imported when it is asked for: ai2thor is slow to import, and the simulator's process needs
    # none of it.
    if name != "Controller":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from infthor_sim.controller import Controller

    return Controller
