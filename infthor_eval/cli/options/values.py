"""Types of option values, and options that several commands share."""

import math
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import click

from infthor_eval.errors import UsageError, unknown_name
from model_adapters.options.parsing import read_pairs

Command = TypeVar("Command", bound=Callable[..., Any])
PATH = click.Path(path_type=Path)


class SetPath(click.ParamType):
    """The folder or file of a set, or one on the hub (hf://OWNER/NAME)."""

    name = "path"

    def convert(
        self, value: Any, _param: click.Parameter | None, _context: click.Context | None
    ) -> Path:
        """Return the folder; of a set on the hub, the one that stands for it."""
        from infthor_eval.formats.packed.hub import set_folder

        return set_folder(value)


SET = SetPath()
SCENE_KINDS = ("kitchen", "living-room", "bedroom", "bathroom", "house")  # procedural: KIND-SEED
_LARGEST = 2**63 - 1  # the largest integer of a run's JSON

floor_plans_option = click.option(
    "--data",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Folder with recorded floor plans (thor_scenes/, alfred/layouts/), for scenes among them.",
)

output_option = click.option(
    "--out",
    "--output",
    "output",
    type=PATH,
    default=Path("results"),
    show_default=True,
    help="Folder of the runs.",
)

include_option = click.option(
    "--include-path",
    "include",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    multiple=True,
    help="Folder with your own task files; may be repeated.",
)


def default_option(
    name: str, kind: click.ParamType, default: Any, help: str
) -> Callable[[Command], Command]:
    """Return an option whose help ends with its default."""
    return click.option(name, type=kind, default=default, show_default=True, help=help)


def together(*options: Callable[[Command], Command]) -> Callable[[Command], Command]:
    """Return a decorator that adds several options to a command, in the order of its help."""

    def add(command: Command) -> Command:
        for option in reversed(options):
            command = option(command)
        return command

    return add


class ModelSpec(NamedTuple):
    """A model to evaluate.

    Attributes:
        name: name of the model.
        options: its options, as typed.
    """

    name: str
    options: Mapping[str, str] = {}


class WholeNumber(click.ParamType):
    """A whole number that fits into a run's JSON; an `IntRange` prints that limit in its help.

    Args:
        minimum: the smallest number allowed.
    """

    name = "integer"

    def __init__(self, minimum: int = -_LARGEST) -> None:
        self._minimum = minimum

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """See `click.ParamType`."""
        number = int(click.INT.convert(value, param, ctx))
        if number < self._minimum:
            self.fail(f"{number} is less than {self._minimum}.", param, ctx)
        if number > _LARGEST:
            self.fail(f"{number} is more than {_LARGEST}.", param, ctx)
        return number


class FiniteFloat(click.FloatRange):
    """A number within a range; `FloatRange` lets "nan" through, which no bound excludes."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """See `click.FloatRange`."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value!r} is not a number.", param, ctx)
        return number


class SceneName(click.ParamType):
    """The name of a procedural scene or of a floor plan, which need not exist; with `houses`, it
    may be the path of a house's file, too."""

    name = "SCENE"

    def __init__(self, *, houses: bool = False) -> None:
        self._houses = houses

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> str | Path:
        """See `click.ParamType`."""
        if self._houses and str(value).endswith(".json"):
            return Path(value)
        kind, _, seed = str(value).rpartition("-")
        has_seed = re.fullmatch(r"[0-9]+", seed) is not None
        if (kind in SCENE_KINDS and has_seed) or str(value).startswith("FloorPlan"):
            return str(value)
        procedural = [f"{kind}-{seed if has_seed else '<seed>'}" for kind in SCENE_KINDS]
        raise unknown_name("scene", value, [*procedural, "FloorPlan<N> with --data"])


class ModelArgs(click.ParamType):
    """Options of a model: `k=v,k=v`, or a mapping where a file gives them."""

    name = "K=V,..."

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> dict[str, str]:
        """See `click.ParamType`."""
        if isinstance(value, Mapping):
            return dict(value)
        return parse_pairs(value.split(","), param.opts[0]) if param else parse_model_args(value)


class ModelList(click.ParamType):
    """Models by name, each with its options: `A:k=v,k=v,B`. Each `A:` begins another model."""

    name = "MODEL[:K=V,...],..."

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[ModelSpec, ...]:
        """See `click.ParamType`."""
        if isinstance(value, tuple):
            return value
        return _parse_models(value, param.opts[0] if param else "--model")


def _parse_models(text: str, option: str) -> tuple[ModelSpec, ...]:
    models: list[tuple[str, list[str]]] = []
    for part in filter(None, map(str.strip, text.split(","))):
        before, equals, _ = part.partition("=")
        # The last colon: a name may hold one (FILE.py:CLASS), a key may not.
        name, colon, _ = before.rpartition(":")
        if not equals:
            models.append((part, []))
        elif colon:
            models.append((name, [part.removeprefix(f"{name}:")]))
        elif models:
            models[-1][1].append(part)
        else:
            raise click.UsageError(f"{option}: {part!r} comes before any model; write MODEL:{part}")
    specs = [ModelSpec(name, parse_pairs(pairs, f"{option} {name}")) for name, pairs in models]
    if not specs or not all(spec.name for spec in specs):
        raise click.UsageError(f"{option} is empty; give a name")
    return tuple(spec for number, spec in enumerate(specs) if spec not in specs[:number])


def split_names(text: str, option: str) -> tuple[str, ...]:
    """Return the names in a list with commas, each once.

    Raises:
        click.UsageError: the list is empty.
    """
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    if not names:
        raise click.UsageError(f"{option} is empty; give a name")
    return names


def parse_model_args(text: str) -> dict[str, str]:
    """Return the options of a model, written as lm-eval writes them: `k=v,k=v`.

    Raises:
        click.UsageError: an item is not `k=v`, or a key is given twice.
    """
    return parse_pairs(text.split(","), "--model-args")


def parse_pairs(pairs: Iterable[str], option: str) -> dict[str, str]:
    """Return keys and values written as `k=v`; messages name the option that they belong to.

    Raises:
        click.UsageError: an item is not `k=v`, or a key is given twice.
    """
    try:
        return read_pairs(pairs, option)
    except UsageError as error:
        raise click.UsageError(str(error)) from error
