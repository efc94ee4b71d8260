"""Memories by name: built in, of other packages (entry points), and of a user's file.

A file has a class, or a function: `def recall(images, question)`.

To add a memory: a class in this package and its line in `MEMORIES` (`docs/memories.md`).
"""

import dataclasses
import inspect
import typing
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import lru_cache
from typing import Any, overload

import msgspec
from PIL import Image

from infthor_eval.errors import ModelError, UsageError, UserCodeError, in_one_line, wrap_user_code
from infthor_eval.memory.protocol import (
    Memory,
    MemoryCapabilities,
    Observation,
    Query,
    Recalled,
    TrajectoryFacts,
)
from infthor_eval.plugins import PluginTable
from infthor_eval.storage.deadlines import limit_time
from infthor_eval.storage.digests import json_values
from infthor_eval.storage.limits import MEMORY_SECONDS
from model_adapters.adapter_identity import package_identity
from model_adapters.options.parsing import read_pairs
from model_adapters.own_file import file_identity, load_from_file, name_in_file, names_a_file
from model_adapters.own_function import OwnFunction, read_function

_FRAMES = "infthor_eval.memory.frames"
_RETRIEVAL = "infthor_eval.memory.retrieval"
_TEXTS = "infthor_eval.memory.texts"
_CACHES = "infthor_eval.memory.caches"
MEMORIES = PluginTable(
    "memory",
    "infthor_eval.memories",
    {
        "none": f"{_FRAMES}:Nothing",
        "last": f"{_FRAMES}:Last",
        "uniform": f"{_FRAMES}:Uniform",
        "clip": f"{_RETRIEVAL}:Clip",
        "clip-view": f"{_RETRIEVAL}:ClipView",
        "notes": f"{_TEXTS}:Notes",
        "text-log": f"{_TEXTS}:TextLog",
        "oracle": f"{_FRAMES}:Oracle",
        "random": f"{_FRAMES}:Random",
        "kv-window": f"{_CACHES}:KvWindow",
        "kv-sinks": f"{_CACHES}:KvSinks",
        "kv-uniform": f"{_CACHES}:KvUniform",
        "kv-random": f"{_CACHES}:KvRandom",
        "kv-oracle": f"{_CACHES}:KvOracle",
        "kv-question": f"{_CACHES}:KvQuestion",
        "kv-norm": f"{_CACHES}:KvNorm",
        "kv-merge": f"{_CACHES}:KvMerge",
        "kv-8bit": f"{_CACHES}:KvEightBits",
    },
    "docs/memories.md",
)
MemoryArgs = tuple[tuple[str, Any], ...]  # names and values, sorted
_FORM = ("images", "question")


def open_memory(name: str, options: MemoryArgs = ()) -> Memory:
    """Return a memory, the same object each time for a class and its options.

    Args:
        name: a name of the table, or FILE.py:NAME with a class or a function.
        options: options of its class; texts are converted to the types of its constructor.

    Raises:
        UsageError: there is no such memory or option, a value is not valid, or it lacks a member of
            the protocol.
        ModelError: the file of a memory of one's own does not define it, or cannot be imported.
    """
    return _build(name, memory_class(name), options)


def accepted_options(name: str) -> Mapping[str, inspect.Parameter]:
    """Return the options of a memory by name: the parameters of its class.

    Raises:
        UsageError: there is no such memory.
        ModelError: its file does not define it, or cannot be imported.
    """
    return inspect.signature(memory_class(name)).parameters


def memory_identity(name: str, options: MemoryArgs = ()) -> dict[str, Any]:
    """Return everything that can change what a memory recalls, as JSON values.

    Raises:
        UsageError: it cannot be opened.
        ModelError: its source cannot be read, or its identity is none.
        UserCodeError: it fails.
    """
    memory = open_memory(name, options)
    with wrap_memory_errors(name):
        given = memory.identity()
    try:
        identity = dict(json_values(given, "identity()"))
    except (TypeError, ValueError) as error:
        hint = "give numbers, texts, lists and dicts"
        raise ModelError(f"the memory {name}: {in_one_line(error)}; {hint}") from error
    own = name_in_file(name) if names_a_file(name) else name
    about = {"name": own, "options": dict(options), "privileged": memory.capabilities.privileged}
    return {"memory": {**about, **_code(name)}} | identity


def parse_options(text: str | None) -> dict[str, str] | None:
    """Return the options of a memory, written as `k=v,k=v`; None if none are given.

    Raises:
        UsageError: an item is not `k=v`, or a key is given twice.
    """
    return None if text is None else read_pairs(text.split(","), "--memory-args")


@contextmanager
def wrap_memory_errors(name: str) -> Iterator[None]:
    """Turn whatever a memory raises into an error of one line; ours pass unchanged.

    A memory that takes longer than `limits.MEMORY_SECONDS` for one call fails, too.
    """
    seconds = MEMORY_SECONDS.value
    late = f"the memory {name} is not done after {seconds} s; fix it; {MEMORY_SECONDS.hint}"
    with (
        wrap_user_code(f"the memory {name} fails", "fix it"),
        limit_time(seconds, UserCodeError(late)),
    ):
        yield


@lru_cache(maxsize=8)  # by the class: an edited file has another one
def _build(name: str, kind: Any, options: MemoryArgs) -> Memory:
    values = _converted(name, kind, dict(options))
    with wrap_memory_errors(name):
        try:
            memory = kind(**values)
        except (TypeError, ValueError) as error:
            raise UsageError(
                f"the memory {name} cannot be made ({in_one_line(error)}); see docs/memories.md"
            ) from error
        names = [member for member in vars(Memory) if not member.startswith("_")]
        missing = [member for member in names if not hasattr(memory, member)]
        if missing:
            raise UsageError(f"the memory {name} lacks {', '.join(missing)}; see docs/memories.md")
        capabilities = memory.capabilities
    if not isinstance(capabilities, MemoryCapabilities):
        given = f"{capabilities!r:.60}"
        raise UsageError(
            f"the memory {name}: its capabilities are {given}; make them MemoryCapabilities"
        )
    opened: Memory = memory
    return opened


def memory_class(name: str) -> Any:
    """Return the class of a memory, or what makes one of a function.

    Raises:
        UsageError: there is none of this name.
        ModelError: its file does not define it, or cannot be imported.
    """
    if names_a_file(name):
        own = load_from_file(name)
        return _function_memory(name, own) if inspect.isfunction(own) else own
    return MEMORIES.load(name, Memory)


def _code(name: str) -> dict[str, Any]:
    if names_a_file(name):
        return file_identity(name)
    return {} if name in MEMORIES.built_in else package_identity(MEMORIES.entry_points()[name])


def _converted(name: str, kind: Any, options: Mapping[str, Any]) -> dict[str, Any]:
    known = inspect.signature(kind).parameters
    maker = kind.__init__ if isinstance(kind, type) else kind  # type: ignore[misc]
    hints = typing.get_type_hints(maker)
    values = {}
    for key, value in options.items():
        if key not in known:
            raise UsageError(
                f"the memory {name} has no option {key}; it has {', '.join(known) or 'none'}"
            )
        try:
            values[key] = msgspec.convert(value, hints.get(key, Any), strict=False)
        except msgspec.ValidationError as error:
            raise UsageError(
                f"the memory {name}: {key} is {value!r:.60} ({in_one_line(error)})"
            ) from error
    return values


class _FunctionMemory:
    """Recalls the images whose numbers a function returns, the most important first.

    As many as the budget holds are shown, in time order.

    Args:
        function: takes all images of the trajectory and the question.
        options: values of its further parameters.
    """

    # Whether it repeats itself is unknown, so that nobody relies on it.
    capabilities = MemoryCapabilities(deterministic=False)

    def __init__(self, function: OwnFunction, options: dict[str, Any]) -> None:
        self._function = function
        self._options = options
        self._steps: list[Observation] = []
        self._size: int | None = None

    def identity(self) -> dict[str, Any]:
        """Return nothing: the file and the options are known."""
        return {}

    def begin(self, facts: TrajectoryFacts) -> None:
        """Forget everything; see `Memory`."""
        self._steps = []
        self._size = facts.tokens_per_frame

    def observe(self, observation: Observation) -> None:
        """Keep a step."""
        self._steps.append(observation)

    def recall(self, query: Query, budget: int | None) -> Recalled:
        """Return the steps that the function names, as many as fit."""
        steps = list(self._steps)
        numbers = self._function.call(_Images(steps), query.text, **self._options)
        chosen = list(dict.fromkeys(self._checked(numbers, len(steps))))
        if budget is not None and self._size:
            chosen = chosen[: budget // self._size]
        return [steps[number] for number in sorted(chosen)]

    def _checked(self, numbers: Any, n_images: int) -> list[int]:
        try:
            whole = [number.__index__() for number in numbers]
        except (TypeError, AttributeError) as error:
            raise self._problem(numbers, n_images) from error
        if not all(0 <= number < n_images for number in whole):
            raise self._problem(numbers, n_images)
        return whole

    def _problem(self, numbers: Any, n_images: int) -> UserCodeError:
        allowed = (
            f"the numbers of images, from 0 to {n_images - 1}: `return [0, 5]`"
            if n_images
            else "nothing where there are no images yet: `return []`"
        )
        return UserCodeError(f"{self._function.name} returned {numbers!r:.60}; return {allowed}")


class _Images(Sequence[Image.Image]):
    """The images of a trajectory, each read when it is looked at."""

    def __init__(self, steps: Sequence[Observation]) -> None:
        self._steps = steps

    def __len__(self) -> int:
        return len(self._steps)

    @overload
    def __getitem__(self, place: int) -> Image.Image: ...
    @overload
    def __getitem__(self, place: slice) -> list[Image.Image]: ...
    def __getitem__(self, place: int | slice) -> Image.Image | list[Image.Image]:
        if isinstance(place, slice):
            return [step.frame.load() for step in self._steps[place]]
        return self._steps[place].frame.load()


@lru_cache(maxsize=8)  # the same maker each time, by which opened memories are known
def _function_memory(name: str, function: Callable[..., Any]) -> Callable[..., _FunctionMemory]:
    """Return what makes a memory of a function, with its further parameters as options.

    Args:
        name: FILE.py:NAME, as the user gave it.
        function: what has that name in the file.
    """
    own = read_function(name, function, (_FORM,))
    fields = dataclasses.fields(own.options)

    def make(**options: Any) -> _FunctionMemory:
        return _FunctionMemory(own, dataclasses.asdict(own.options(**options)))

    make.__signature__ = inspect.signature(own.options)  # type: ignore[attr-defined]
    make.__annotations__ = {field.name: field.type for field in fields}
    return make
