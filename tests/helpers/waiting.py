"""Waiting for what another process or thread does, on a machine that may be busy with other
work."""

import subprocess
import time
from collections.abc import Callable
from typing import Any

__all__ = ["PATIENCE_S", "wait_until"]

PATIENCE_S = 600.0  # a guard against hangs, never a measure of speed


def wait_until(
    condition: Callable[[], object], process: "subprocess.Popen[Any] | None" = None
) -> None:
    """Return once the condition holds.

    Args:
        condition: what is waited for.
        process: it must go on running meanwhile; None for none.
    """
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        if process is not None and process.poll() is not None:
            output = process.stderr.read() if process.stderr is not None else ""
            raise AssertionError(f"the process ended with {process.returncode}: {output}")
        assert time.monotonic() < deadline
        time.sleep(0.01)
