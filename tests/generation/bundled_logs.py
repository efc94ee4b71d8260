"""Logs of bundled sets beside those that are made again today."""

from pathlib import Path

from infthor_eval.formats.step_log import Step, read_steps


def steps_as_bundled(folder: Path) -> list[Step]:
    """The steps of a trajectory's log, without what the bundled ones do not have yet: the shares of
    objects that lie within the frame."""
    steps = read_steps(folder)
    for shown in (shown for step in steps for shown in (step.seen or {}).values()):
        shown.inside = shown.top_inside = 1.0
    return steps
