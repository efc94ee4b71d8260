# ruff: noqa: SIM905 - tables of names read best as words
"""The table of actions, and the checking of their arguments as Unity's dispatcher does it."""

import inspect
import json
import types
import typing
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Concatenate

from infthor_eval.sim.actions.signatures import expectation, type_name
from infthor_eval.sim.actions.vectors import Vector3
from infthor_eval.sim.errors import ActionError, ErrorCode
from infthor_eval.sim.settings import AGENT_MODES
from infthor_eval.sim.simulation import Simulation

__all__ = ["Action", "Vector3", "action", "bind", "names"]

_PASSED_BY = frozenset(
    "action sequenceId agentId renderImage renderDepthImage renderClassImage renderObjectImage renderNormalsImage"
    " renderFlowImage renderSemanticSegmentation renderInstanceSegmentation visibilityDistance fixedDeltaTime"
    " physicsSimulationParams".split()
)

_LARGEST = 1e9


Body = Callable[Concatenate[Simulation, ...], Any]
Form = tuple[str, ...]


@dataclass(frozen=True)
class Action:
    """One action: its function, which takes the simulation and the wire's arguments by name, and their types.

    Attributes:
        query: it changes nothing that is seen, so the client keeps its last frame.
        lenient: unknown arguments are passed over, as in the actions that take Unity's whole ServerAction.
        forms: sets of arguments one of which must be given whole, as Unity overloads its actions; none for one form.
    """

    name: str
    run: Body
    parameters: Mapping[str, inspect.Parameter]
    query: bool
    lenient: bool
    forms: tuple[Form, ...] = ()


_ACTIONS: dict[str, dict[str, Action]] = {mode: {} for mode in AGENT_MODES}


def action(
    *names: str,
    query: bool = False,
    lenient: bool = False,
    forms: tuple[Form, ...] = (),
    modes: tuple[str, ...] = AGENT_MODES,
) -> Callable[[Body], Body]:
    """Register a function as the action(s) `names` of some agent modes; see `Action`.

    As in Unity, whose arm agents descend from the default one: what they do otherwise takes the place of what all do,
    in whatever order the two are registered.
    """

    def register(run: Body) -> Body:
        parameters = dict(list(inspect.signature(run).parameters.items())[1:])
        for name in names:
            made = Action(name, run, parameters, query, lenient, forms)
            for mode in modes:
                if modes == AGENT_MODES:
                    _ACTIONS[mode].setdefault(name, made)
                else:
                    _ACTIONS[mode][name] = made
        return run

    return register


def names(mode: str = "default") -> list[str]:
    """All actions of an agent mode, sorted."""
    return sorted(_ACTIONS[mode])


def bind(message: Mapping[str, Any], mode: str = "default") -> tuple[Action, dict[str, Any]]:
    """The action of a message to an agent of some mode, and its checked arguments.

    Raises:
        ActionError: no such action; an argument is unknown, missing or of the wrong type.
    """
    name = message.get("action")
    found = _ACTIONS[mode].get(name) if isinstance(name, str) else None
    if found is None:
        raise ActionError(f"Invalid action: {name}", ErrorCode.INVALID_ACTION)
    given = {key: value for key, value in message.items() if key not in _PASSED_BY or key in found.parameters}
    form = _form(found, given)
    other_forms = {key for other in found.forms for key in other if key not in form}
    unknown = [key for key in given if key not in found.parameters or (key in other_forms and given[key] is not None)]
    if unknown and not found.lenient:
        raise ActionError(expectation(found.name, unknown, found.parameters, given), ErrorCode.INVALID_ARGUMENT)
    arguments = {key: value for key, value in given.items() if key in found.parameters}
    for key, value in arguments.items():
        _check(found, key, value)
    missing = [key for key, p in found.parameters.items() if _required(key, p, form) and arguments.get(key) is None]
    if missing:
        raise ActionError(
            f"action: {found.name} is missing the following arguments: {','.join(missing)}", ErrorCode.MISSING_ARGUMENTS
        )
    return found, arguments


def _form(found: Action, given: Mapping[str, Any]) -> Form:
    """The form that most of the given arguments belong to, the first of several."""
    return max(found.forms, key=lambda form: sum(given.get(key) is not None for key in form), default=())


def _required(key: str, parameter: inspect.Parameter, form: Form) -> bool:
    return key in form or parameter.default is inspect.Parameter.empty


def _check(found: Action, key: str, value: Any) -> None:
    """Refuse a value of the wrong type; Unity's dispatcher knows scalars, its parser of JSON all else.

    Raises:
        ActionError: with a code only where Unity has one, as the client raises by it.
    """
    annotation = found.parameters[key].annotation
    if _fits(value, annotation):
        return
    wanted, told = type_name(annotation), value if isinstance(value, str) else json.dumps(value)
    if _structured(annotation) and not isinstance(value, dict | list):
        raise ActionError(f"Error converting value {told} to type '{wanted}'. Path '{key}'.")
    raise ActionError(
        f"action: {found.name} has an invalid argument: {key} (=={told}). Cannot convert to: {wanted}",
        ErrorCode.INVALID_ARGUMENT,
    )


def _structured(annotation: Any) -> bool:
    """Whether values of this type are objects or lists in JSON."""
    origin, inner = typing.get_origin(annotation), typing.get_args(annotation)
    if origin in (types.UnionType, typing.Union):
        return any(_structured(option) for option in inner)
    return annotation is Vector3 or origin is list


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
