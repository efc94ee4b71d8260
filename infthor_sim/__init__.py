"""The embedded simulator: a process that takes the place of the Unity build of AI2-THOR.

`python -m infthor_sim.player` speaks the FIFO protocol of ai2thor 5.0.0, so the unmodified
`ai2thor.controller.Controller` drives it through `local_executable_path`. No other package imports
this one; all use it as that process. Its geometry is calibrated on recordings of AI2-THOR, its
looks are not.

It differs from Unity on purpose in these points (docs/simulator.md lists all of them by action):

- Nothing rolls or topples, and nothing moves between actions.
- A door that opens is not stopped by the agent, but an open door stops the agent.
- What the agent holds is stopped by the outer walls only while it walks.
- An object has one parent receptacle, the innermost.
- In a recorded floor plan the agent can stand only on the cells of the recording.
- In a recorded floor plan a pick-up may reach what only the coarse box of its open receptacle
  hides. `visible` stays false then.
"""
