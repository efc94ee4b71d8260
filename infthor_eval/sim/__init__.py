"""The embedded simulator: a process that stands in for the Unity build of AI2-THOR.

`python -m infthor_eval.sim` speaks the FIFO protocol of ai2thor 5.0.0, so the unmodified
`ai2thor.controller.Controller` drives it through `local_executable_path`. Nothing outside this package imports it;
everybody reaches it as that process. Its geometry is calibrated on recordings of AI2-THOR, its looks are not.

Where it differs from Unity on purpose: nothing falls, rolls or topples; a door that opens is not stopped by the agent
(but an open door stops the agent); what the agent holds is stopped by the outer walls only; an object has one parent
receptacle, the innermost; positions outside the navigation grid of a recorded floor plan cannot be stood at; a pick-up
in a recorded floor plan may reach what only the coarse box of its open receptacle hides (`visible` stays false then).
"""

__all__: list[str] = []
