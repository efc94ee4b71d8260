# ruff: noqa: SIM905 - tables of names read best as words
"""The table of actions, and the checks of their arguments, which imitate Unity's dispatcher.

Messages about wrong arguments print their types in Unity's words.
"""

import inspect
import json
import types
import typing
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Concatenate, TypeGuard

from infthor_sim.errors import ActionError, ErrorCode
from infthor_sim.settings import AGENT_MODES
from infthor_sim.simulation import Simulation

# The client adds these to messages of any action; Unity reads them before it looks for the action's
# own arguments.
_MESSAGE_KEYS = frozenset(
    "action sequenceId agentId renderImage renderDepthImage renderClassImage renderObjectImage "
    "renderNormalsImage renderFlowImage renderSemanticSegmentation renderInstanceSegmentation "
    "visibilityDistance fixedDeltaTime actionSimulationSeconds physicsSimulationParams "
    "imageDigest".split()  # the last one is ours
)
_LARGEST = 1e9  # of a number; squares of larger ones would overflow in the geometry


ActionFunction = Callable[Concatenate[Simulation, ...], Any]
Overload = tuple[str, ...]


@dataclass(frozen=True)
class Action:
    """One action.

    Attributes:
        name: name on the wire.
        run: function that takes the simulation and the wire's arguments by name.
        parameters: parameters of `run` without the simulation; their annotations are the accepted
            types.
        modes: agent modes that it was registered for.
        query: it changes nothing that is seen, so the client keeps its last frame.
        lenient: unknown arguments are ignored, as in the actions that take Unity's whole
            ServerAction.
        overloads: alternative sets of required arguments, for actions that Unity overloads.
    """

    name: str
    run: ActionFunction
    parameters: Mapping[str, inspect.Parameter]
    modes: tuple[str, ...]
    query: bool
    lenient: bool
    overloads: tuple[Overload, ...] = ()


_ACTIONS: dict[str, dict[str, Action]] = {mode: {} for mode in AGENT_MODES}


def action(
    *names: str,
    query: bool = False,
    lenient: bool = False,
    overloads: tuple[Overload, ...] = (),
    modes: tuple[str, ...] = AGENT_MODES,
) -> Callable[[ActionFunction], ActionFunction]:
    """Register a function as the action(s) `names` of some agent modes; see `Action`."""

    def register(run: ActionFunction) -> ActionFunction:
        parameters = dict(list(inspect.signature(run).parameters.items())[1:])
        for name in names:
            new = Action(name, run, parameters, modes, query, lenient, overloads)
            for mode in modes:
                # Unity's other agents descend from the default one and override some of its
                # actions. An action of fewer modes wins over one of more, whichever module is
                # imported first.
                known = _ACTIONS[mode].get(name)
                if known is None or len(modes) < len(known.modes):
                    _ACTIONS[mode][name] = new
        return run

    return register


def action_names(mode: str = "default") -> list[str]:
    """Return the names of an agent mode's actions, sorted."""
    return sorted(_ACTIONS[mode])


def bind(message: Mapping[str, Any], mode: str = "default") -> tuple[Action, dict[str, Any]]:
    """Return the action that a message names in an agent mode, and its checked arguments."""
    name = message.get("action")
    called = _ACTIONS[mode].get(name) if isinstance(name, str) else None
    if called is None:
        raise ActionError(f"Invalid action: {name}", ErrorCode.INVALID_ACTION)
    passed = {
        key: value
        for key, value in message.items()
        if key not in _MESSAGE_KEYS or key in called.parameters
    }
    overload = _chosen_overload(called, passed)
    other_names = set().union(*called.overloads).difference(overload)
    unknown = [
        key
        for key in passed
        if key not in called.parameters or (key in other_names and passed[key] is not None)
    ]
    if unknown and not called.lenient:
        text = _unknown_arguments_text(called.name, unknown, called.parameters, passed)
        raise ActionError(text, ErrorCode.INVALID_ARGUMENT)
    arguments = {key: value for key, value in passed.items() if key in called.parameters}
    for key, value in arguments.items():
        _check_type(called, key, value)
    missing = [
        key
        for key, parameter in called.parameters.items()
        if key in overload or parameter.default is inspect.Parameter.empty
        if arguments.get(key) is None
    ]
    if missing:
        raise ActionError(
            f"action: {called.name} is missing the following arguments: {','.join(missing)}",
            ErrorCode.MISSING_ARGUMENTS,
        )
    return called, arguments


def _chosen_overload(called: Action, passed: Mapping[str, Any]) -> Overload:
    """Return the overload that most of the passed arguments belong to; the first if they tie."""
    return max(
        called.overloads,
        key=lambda names: sum(passed.get(name) is not None for name in names),
        default=(),
    )


def _check_type(called: Action, key: str, value: Any) -> None:
    """Refuse an argument of the wrong type."""
    annotation = called.parameters[key].annotation
    if _matches(value, annotation):
        return
    expected = _type_name(annotation)
    text = value if isinstance(value, str) else json.dumps(value)
    # Unity's dispatcher converts scalars itself and reports a code. A scalar in place of a vector
    # or list fails earlier, in its JSON parser, without a code.
    if _is_structured(annotation) and not isinstance(value, dict | list):
        raise ActionError(f"Error converting value {text} to type '{expected}'. Path '{key}'.")
    raise ActionError(
        f"action: {called.name} has an invalid argument: {key} (=={text}). Cannot convert to: "
        f"{expected}",
        ErrorCode.INVALID_ARGUMENT,
    )


def _is_structured(annotation: Any) -> bool:
    """Return whether values of this type are objects or lists in JSON."""
    origin = typing.get_origin(annotation)
    inner = typing.get_args(annotation)
    if origin in (types.UnionType, typing.Union):
        return any(_is_structured(option) for option in inner)
    return annotation is Vector3 or origin is list


def _matches(value: Any, annotation: Any) -> bool:
    """Return whether a JSON value fits a parameter's type; "1" is no number, 1 no boolean."""
    origin = typing.get_origin(annotation)
    inner = typing.get_args(annotation)
    if annotation is Any or annotation is types.NoneType:
        return annotation is Any or value is None
    if origin in (types.UnionType, typing.Union):
        return any(_matches(value, option) for option in inner)
    if annotation is Vector3:
        return is_vector(value)
    if annotation in (int, float):
        return _is_number(value) and (annotation is float or value == int(value))
    if origin is list:
        return isinstance(value, list) and all(_matches(v, inner[0]) for v in value)
    return isinstance(value, origin or annotation)


def is_vector(value: Any) -> TypeGuard[dict[str, float]]:
    """Return whether a JSON value is a vector: {"x", "y", "z"}, where what is absent is 0."""
    return (
        isinstance(value, dict)
        and set(value) <= set("xyz")
        and all(_is_number(v) for v in value.values())
    )


def _is_number(value: Any) -> bool:
    """Return whether a value is a finite number of usable size; Python's JSON has NaN, too."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= _LARGEST


class Vector3(dict[str, float]):
    """A position (metres) or rotation (degrees): `{"x", "y", "z"}`, any of them absent."""


_SCALARS = {int: "int", float: "float", str: "String", bool: "Boolean", Vector3: "Vector3"}


def _type_name(annotation: Any) -> str:
    """Return Unity's name of a type; an optional type is called as its value."""
    origin = typing.get_origin(annotation)
    inner = typing.get_args(annotation)
    if origin in (types.UnionType, typing.Union):
        return _type_name(next(option for option in inner if option is not types.NoneType))
    if origin is list:
        return f"{_type_name(inner[0])}[]"
    return _SCALARS.get(annotation, "Object")


def _unknown_arguments_text(
    name: str, unknown: Sequence[str], parameters: Mapping[str, inspect.Parameter], passed: Any
) -> str:
    """Return Unity's message about unknown arguments, with those that the action takes."""
    plural = "s" if len(unknown) > 1 else ""
    expected = ", ".join(_parameter_text(parameter) for parameter in parameters.values())
    return (
        f'\n\tAction: "{name}" called with invalid argument{plural}: {_quote(unknown)}'
        f"\n\tExpected arguments: {expected}\n\tYour arguments: {_quote(passed)}"
    )


def _parameter_text(parameter: inspect.Parameter) -> str:
    text = f"{_type_name(parameter.annotation)} {parameter.name}"
    if parameter.default is inspect.Parameter.empty:
        return text
    return f"{text} = {'' if parameter.default is None else parameter.default}"


def _quote(names: Any) -> str:
    return ", ".join(f"'{name}'" for name in names)
