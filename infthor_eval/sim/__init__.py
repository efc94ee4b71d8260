"""The embedded simulator: a process that stands in for the Unity build of AI2-THOR.

`python -m infthor_eval.sim` speaks the FIFO protocol of ai2thor 5.0.0, so the unmodified
`ai2thor.controller.Controller` drives it through `local_executable_path`. Nothing outside this package imports it;
everybody reaches it as that process. Its geometry is calibrated on recordings of AI2-THOR, its looks are not.
"""

__all__: list[str] = []
