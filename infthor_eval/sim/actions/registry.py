# ruff: noqa: SIM905 - tables of names read best as words
"""The table of actions, and the checking of their arguments as Unity's dispatcher does it."""

import inspect
import types
import typing
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Concatenate

from infthor_eval.sim.errors import ActionError, ErrorCode
from infthor_eval.sim.simulation import Simulation

__all__ = ["Action", "Vector3", "action", "bind", "names"]

_PASSED_BY = frozenset(
    "action sequenceId agentId renderImage renderDepthImage renderClassImage renderObjectImage renderNormalsImage"
    " renderFlowImage renderSemanticSegmentation renderInstanceSegmentation visibilityDistance fixedDeltaTime"
    " physicsSimulationParams".split()
)

_LARGEST = 1e9


class Vector3(dict[str, float]):
    """Marks arguments that are a position (metres) or rotation (degrees): `{"x", "y", "z"}`, any of them absent."""


Body = Callable[Concatenate[Simulation, ...], Any]


@dataclass(frozen=True)
class Action:
    """One action: its function, which takes the simulation and the wire's arguments by name, and their types.

    Attributes:
        query: it changes nothing that is seen, so the client keeps its last frame.
        lenient: unknown arguments are passed over, as in the actions that take Unity's whole ServerAction.
    """

    name: str
    run: Body
    parameters: Mapping[str, inspect.Parameter]
    query: bool
    lenient: bool


_ACTIONS: dict[str, Action] = {}


def action(*names: str, query: bool = False, lenient: bool = False) -> Callable[[Body], Body]:
    """Register a function as the action(s) `names`; see `Action`."""

    def register(run: Body) -> Body:
        parameters = dict(list(inspect.signature(run).parameters.items())[1:])
        for name in names:
            _ACTIONS[name] = Action(name, run, parameters, query, lenient)
        return run

    return register


def names() -> list[str]:
    """All actions, sorted."""
    return sorted(_ACTIONS)


def bind(message: Mapping[str, Any]) -> tuple[Action, dict[str, Any]]:
    """The action of a message and its checked arguments.

    Raises:
        ActionError: no such action; an argument is unknown, missing or of the wrong type.
    """
    name = message.get("action")
    found = _ACTIONS.get(name) if isinstance(name, str) else None
    if found is None:
        raise ActionError(f"Invalid action: {name!r}. No method of that name exists.", ErrorCode.INVALID_ACTION)
    given = {key: value for key, value in message.items() if key not in _PASSED_BY or key in found.parameters}
    unknown = sorted(set(given) - set(found.parameters))
    if unknown and not found.lenient:
        raise ActionError(_misuse(found, "called with invalid argument", unknown, given), ErrorCode.INVALID_ARGUMENT)
    arguments = {key: value for key, value in given.items() if key in found.parameters}
    wrong = sorted(key for key, value in arguments.items() if not _fits(value, found.parameters[key].annotation))
    if wrong:
        raise ActionError(_misuse(found, "called with a wrong type of argument", wrong, given),
                          ErrorCode.INVALID_ARGUMENT)  # fmt: skip
    missing = [
        key for key, p in found.parameters.items() if p.default is inspect.Parameter.empty and key not in arguments
    ]
    if missing:
        raise ActionError(_misuse(found, "is missing argument", missing, given), ErrorCode.MISSING_ARGUMENTS)
    return found, arguments


def _misuse(found: Action, what: str, which: list[str], given: Mapping[str, Any]) -> str:
    expected = ", ".join(f"{_type_name(p.annotation)} {key}" for key, p in found.parameters.items()) or "none"
    quoted = ", ".join(f"'{key}'" for key in which)
    yours = ", ".join(sorted(given)) or "none"
    return f'Action: "{found.name}" {what}: {quoted}. Expected arguments: {expected}. Your arguments: {yours}.'


def _type_name(annotation: Any) -> str:
    return getattr(annotation, "__name__", str(annotation)) if annotation is not Any else "object"


def _fits(value: Any, annotation: Any) -> bool:
    origin, inner = typing.get_origin(annotation), typing.get_args(annotation)
    if annotation is Any or annotation is types.NoneType:
        return annotation is Any or value is None
    if origin in (types.UnionType, typing.Union):
        return any(_fits(value, option) for option in inner)
    if annotation is Vector3:
        return isinstance(value, dict) and set(value) <= set("xyz") and all(_is_number(v) for v in value.values())
    if annotation in (int, float):
        return _is_number(value) and (annotation is float or value == int(value))
    if origin is list:
        return isinstance(value, list) and all(_fits(v, inner[0]) for v in value)
    return isinstance(value, origin or annotation)


def _is_number(value: Any) -> bool:
    """Whether a value is a number that geometry can bear: JSON lets NaN and infinities through."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= _LARGEST
