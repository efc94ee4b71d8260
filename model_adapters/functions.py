"""Functions of a user's own file as adapters: the smallest model, and the smallest policy.

`def answer(images, text)` and `def answer(parts)` reply to a conversation, `def act(image,
instruction)` moves an arm. A class (`docs/own-models.md`) has more: shared prefixes, counts of
tokens, batches.
"""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from PIL import Image

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.plugins import import_target
from model_adapters.backend import UncountedBackend
from model_adapters.own_function import OwnFunction, read_function
from model_adapters.protocols import Capabilities, Decoding, FramePolicy, Model, Reply, Turn
from model_adapters.thinking import cut_at_stop

_IMAGES, _PARTS, _ACTION = ("images", "text"), ("parts",), ("image", "instruction")
_POLICY = "model_adapters.policies.function:FunctionPolicy"  # imported when there is one


def function_adapter(name: str, function: Callable[..., Any]) -> "FunctionAdapter":
    """Return a function as an adapter.

    Args:
        name: FILE.py:NAME, as the user gave it.
        function: what has that name in the file.
    """
    return FunctionAdapter(read_function(name, function, (_IMAGES, _PARTS, _ACTION)))


@dataclass(frozen=True)
class FunctionAdapter:
    """A function in the place of an `Adapter` class."""

    function: OwnFunction

    @property
    def Options(self) -> type:
        """Its parameters with defaults."""
        return self.function.options

    def build(self, name: str, options: Any, seed: int) -> Model | FramePolicy:
        """Return the model or the policy; the seed is not used."""
        values = dataclasses.asdict(options)
        if self.function.takes == _ACTION:
            policy: FramePolicy = import_target(_POLICY)(name, self.function.call, values)
            return policy
        return FunctionModel(name, self.function, values)


@dataclass(frozen=True, eq=False)
class FunctionModel(UncountedBackend):
    """A function that replies to a whole conversation.

    Attributes:
        name: name of the model.
        function: takes all images in time order and all texts as one, or both in order (`parts`).
        options: values of its further parameters.
    """

    name: str
    function: OwnFunction
    options: dict[str, Any]

    # Whether it repeats itself is unknown, so that nobody relies on it.
    capabilities = Capabilities(counts_tokens=False, token_ids=False, deterministic=False)

    def identity(self) -> dict[str, Any]:
        """Return the options; the file's content is known by its digest."""
        return dict(self.options)

    def close(self) -> None:
        """Do nothing: what the function keeps ends with the process."""

    def answer(self, turns: Sequence[Turn], decoding: Decoding) -> Reply:
        """Return what the function returns, cut at the first stop string."""
        parts = _parts_of(turns)
        if self.function.takes == _PARTS:
            text = self.function.call(parts, **self.options)
        else:
            images = [part for part in parts if not isinstance(part, str)]
            words = "".join(part for part in parts if isinstance(part, str))
            text = self.function.call(images, words, **self.options)
        if not isinstance(text, str):
            raise ModelError(f'{self.name} returned {text!r:.60}; return a text: `return "yes"`')
        cut = cut_at_stop(text, decoding.stop)
        return Reply(text if cut is None else cut)


def _parts_of(turns: Sequence[Turn]) -> list[str | Image.Image]:
    """Return texts and images in order; a line break stands between two turns."""
    parts: list[str | Image.Image] = []
    for number, turn in enumerate(turns):
        if number:
            parts.append("\n")
        # No other parts: a video is refused before.
        parts += [part.load() if isinstance(part, FrameRef) else str(part) for part in turn.parts]
    return parts
