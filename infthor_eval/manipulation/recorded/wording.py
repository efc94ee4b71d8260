"""Steps of an arm in words, for people."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from infthor_eval.formats.object_ids import object_type_of
from infthor_eval.manipulation.records import ArmStep

_LEFT_OUT = {"action", "returnToStart"}


def describe_request(step: ArmStep) -> Iterator[str]:
    """Yield a policy's request in centimetres and degrees, then the simulator's calls, by line."""
    if step.delta is not None:
        x, y, z, roll, pitch, yaw, gripper = step.delta
        moved = f"x {100 * x:+.1f}, y {100 * y:+.1f}, z {100 * z:+.1f}"
        turned = (("roll", roll), ("pitch", pitch), ("yaw", yaw))
        angles = ", ".join(f"{name} {math.degrees(value):+.0f}" for name, value in turned)
        yield f"delta: {moved} cm; {angles} deg; gripper {gripper:.2f}"
    yield "; ".join(map(describe_call, step.calls)) or "(no call: the arm stands still)"


def describe_call(call: Mapping[str, Any]) -> str:
    """Return a call of AI2-THOR's, shortened: numbers with three digits, objects by their types."""
    arguments = (_argument(name, value) for name, value in call.items() if name not in _LEFT_OUT)
    return " ".join([str(call.get("action", "?")), *filter(None, arguments)])


def _argument(name: str, value: Any) -> str:
    if isinstance(value, bool) or value is None:
        return name if value else ""
    if isinstance(value, Mapping):
        return " ".join(_argument(str(key), part) for key, part in value.items())
    if isinstance(value, int | float):
        return f"{name} {value:.3g}"
    if isinstance(value, list | tuple):
        return ", ".join(object_type_of(str(part)) for part in value)
    return str(value)
