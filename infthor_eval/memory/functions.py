"""Functions of a user's own file as memories: `def recall(images, question)`."""

import dataclasses
import inspect
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, overload

from PIL import Image

from infthor_eval.errors import UserCodeError
from infthor_eval.memory.protocol import (
    MemoryCapabilities,
    Observation,
    Query,
    Recalled,
    TrajectoryFacts,
)
from model_adapters.own_function import OwnFunction, read_function

_FORM = ("images", "question")


class FunctionMemory:
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
        """Return the steps that the function names, as many as fit.

        Raises:
            UserCodeError: it returns no numbers of images.
            DataError: a frame cannot be read.
        """
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
def function_memory(name: str, function: Callable[..., Any]) -> Callable[..., FunctionMemory]:
    """Return what makes a memory of a function, with its further parameters as options.

    Args:
        name: FILE.py:NAME, as the user gave it.
        function: what has that name in the file.

    Raises:
        ModelError: it takes other parameters.
    """
    own = read_function(name, function, (_FORM,))
    fields = dataclasses.fields(own.options)

    def make(**options: Any) -> FunctionMemory:
        return FunctionMemory(own, dataclasses.asdict(own.options(**options)))

    make.__signature__ = inspect.signature(own.options)  # type: ignore[attr-defined]
    make.__annotations__ = {field.name: field.type for field in fields}
    return make
