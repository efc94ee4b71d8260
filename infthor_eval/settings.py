"""Settings: what each is stands once, in the annotation of its field.

A thing that has settings is a frozen dataclass. The type of a field has the limits
(`msgspec.Meta`), its `Setting` the rest, and from both are made: the options on the command line,
the settings of task files, the config of a run and so its hash, the tables of the documentation,
the refusal of an option without effect, and the names of `explain`.

To add or change a setting: a field with its `Setting` in the suite's class, such as
`infthor_eval/nieh/options.py` or the task settings that `docs/own-tasks.md` names; then
`python -m tests.docs.settings_tables`.
"""

import difflib
import types
import typing
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, fields
from types import NoneType
from typing import Annotated, Any, NamedTuple, TypeVar

import msgspec
from msgspec import Meta

from infthor_eval.errors import DataError, UsageError

T = TypeVar("T")
_LARGE = 10**9  # a limit from it on keeps typing errors out, and is not said
_BOUNDS = {"gt": "above", "ge": "from", "lt": "below", "le": "at most"}
_KINDS = {bool: "true or false", int: "whole number", float: "number", str: "text", dict: "mapping"}


class Shorthand(NamedTuple):
    """A flag that stands for several values of a setting: its name, the values, and its help."""

    name: str
    values: str
    help: str


@dataclass(frozen=True, kw_only=True)
class Setting:
    """What is said of a setting beside its type and default.

    Attributes:
        help: one sentence.
        choices: the values that are allowed; none for all of the type.
        is_a: its valid values in words, where type and limits do not say them.
        of: what a number counts ("kilo-tokens").
        stands_for: what None stands for, where that is one value; a run with it has None's config.
        where: what a task must have for it to have an effect, by the suite's name; "" for nothing.
        in_config: whether it is in the config of a run, as all that can change a number is that
            neither the task's settings nor its sources have.
        cause: what a difference in it is put down to, by the name in `infthor_eval.report.causes`.
        metavar: its value in help texts.
        is_place: whether the value may be a file or folder.
        each: whether several values with commas are a run each.
        shorthands: flags that stand for such values.
    """

    help: str = ""
    choices: tuple[Any, ...] = ()
    is_a: str = ""
    of: str = ""
    stands_for: Any = None
    where: str = ""
    in_config: bool = False
    cause: str = ""
    metavar: str | None = None
    is_place: bool = False
    each: bool = False
    shorthands: tuple[Shorthand, ...] = ()


class Declared(NamedTuple):
    """A setting as a class declares it: its type with limits, its default, and the rest.

    Attributes:
        default: its default; `MISSING` where it must be given.
    """

    type: Any
    default: Any
    setting: Setting

    @property
    def kind(self) -> type:
        """The type without limits and None."""
        return typing.cast("type", _bare(self.type))

    @property
    def is_a(self) -> str:
        """What its values are, in words: "whole number", "list of numbers"."""
        if typing.get_origin(self.kind) is tuple:
            return f"list of {_KINDS[_bare(typing.get_args(self.kind)[0])]}s"
        kind = typing.get_origin(self.kind) or self.kind
        return _KINDS.get(kind, kind.__name__)

    @property
    def valid(self) -> str:
        """Its valid values, in words."""
        setting = self.setting
        if setting.is_a:
            return setting.is_a
        if setting.choices:
            listed = ", ".join(map(str, setting.choices))
            return listed.replace(", ", " or ") if len(setting.choices) == 2 else f"one of {listed}"
        if self.kind is bool:
            return self.is_a
        limits = _limits(self.type)
        words = f"a {self.is_a}" + (f" of {setting.of}" if setting.of else "")
        bounds = [
            f"{said} {limits[name]:,}"
            for name, said in _BOUNDS.items()
            if limits.get(name, _LARGE) < _LARGE
        ]
        return " ".join((words, ", ".join(bounds))).rstrip()

    @property
    def about(self) -> str:
        """What it does and, where only some values are allowed, which."""
        setting = self.setting
        if not setting.choices:
            return setting.help
        return f"{setting.help} ({', '.join(map(str, setting.choices))})".lstrip()

    def takes(self, value: Any) -> bool:
        """Return whether a value is a valid one."""
        try:
            converted = msgspec.convert(value, self.type)
        except msgspec.ValidationError:
            return False
        return not self.setting.choices or converted in (*self.setting.choices, None)


@dataclass(frozen=True)
class NoOptions:
    """Options of a model or a suite that has none."""


def settings_of(kind: type) -> dict[str, Declared]:
    """Return the settings of a dataclass, by name in the order of its fields."""
    hints = typing.get_type_hints(kind, include_extras=True)
    return {
        item.name: Declared(
            hints[item.name],
            item.default if item.default_factory is MISSING else item.default_factory(),
            _setting(hints[item.name]) or Setting(),
        )
        for item in fields(kind)
    }


def check_options(options: Any) -> None:
    """Check the values of a dataclass that are typed as options.

    Raises:
        UsageError: a value is not valid; the message has the valid ones.
    """
    for name, declared in settings_of(type(options)).items():
        value = getattr(options, name)
        if value != declared.default and not declared.takes(value):
            raise UsageError(f"--{name.replace('_', '-')} {value}: give {declared.valid}")


def check_names(
    kind: type, raw: Mapping[Any, Any], location: str, others: Iterable[str] = ()
) -> None:
    """Check that a mapping has no key that is no setting, as a misspelt one is.

    Args:
        others: further keys that it may have.

    Raises:
        DataError: names the key, and the nearest setting.
    """
    known = sorted((*others, *settings_of(kind)))
    for key in raw:
        if key not in known:
            near = difflib.get_close_matches(str(key), known, n=1)
            hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(known)}"
            raise DataError(f"{location}: {key} is not known; {hint}")


def read(kind: type[T], raw: Mapping[str, Any], location: str = "dataset_kwargs") -> T:
    """Return a dataclass with the values of a mapping at a location (for messages); other keys are
    ignored.

    Raises:
        DataError: a value is not valid; the message has location, setting and valid values.
    """
    declared = settings_of(kind)
    given = {name: raw[name] for name in declared if raw.get(name) is not None}
    for name, value in given.items():
        if not declared[name].takes(value):
            raise DataError(f"{location}: {name} is {value!r:.60}; it is {declared[name].valid}")
    return kind(**{name: msgspec.convert(given[name], declared[name].type) for name in given})


def with_settings(config: Any, options: type) -> type:
    """Return the config of a run with those settings that it keeps and does not have yet."""
    has = (typing.get_origin(config) or config).__struct_fields__
    kept = {
        name: declared
        for name, declared in settings_of(options).items()
        if declared.setting.in_config and name not in has
    }
    body = {name: declared.default for name, declared in kept.items()}
    hints = {name: declared.type for name, declared in kept.items()}
    flags = {"frozen": True, "kw_only": True, "omit_defaults": True}
    return types.new_class(
        "Config", (config,), flags, lambda space: space.update(body, __annotations__=hints)
    )


def config_values(options: Any) -> dict[str, Any]:
    """Return the values that the config of a run keeps."""
    values = {
        name: (getattr(options, name), declared)
        for name, declared in settings_of(type(options)).items()
        if declared.setting.in_config
    }
    return {
        name: declared.default if value == declared.setting.stands_for else value
        for name, (value, declared) in values.items()
    }


def causes_of(config: type) -> dict[str, str]:
    """Return what differences in the settings of a config are put down to, by name."""
    hints = typing.get_type_hints(config, include_extras=True).items()
    return {name: said.cause for name, hint in hints if (said := _setting(hint)) is not None}


def _setting(hint: Any) -> Setting | None:
    """Return what is said of a setting, by its type or by that behind `... | None`."""
    said = (item for item in getattr(hint, "__metadata__", ()) if isinstance(item, Setting))
    return next(said, None) or next(filter(None, map(_setting, typing.get_args(hint))), None)


def _bare(hint: Any) -> Any:
    """Return the type behind `Annotated[int, ...] | None`."""
    if typing.get_origin(hint) is Annotated:
        return _bare(hint.__origin__)
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        return _bare(next(one for one in typing.get_args(hint) if one is not NoneType))
    return hint


def _limits(hint: Any) -> dict[str, Any]:
    """Return the limits of a number by their names in `msgspec.Meta`."""
    metas = [item for item in getattr(hint, "__metadata__", ()) if isinstance(item, Meta)]
    found = {name: getattr(meta, name) for meta in metas for name in _BOUNDS}
    inner = [one for one in typing.get_args(hint) if typing.get_origin(hint) is not tuple]
    limits = {name: at for name, at in found.items() if at is not None}
    return {name: at for one in inner for name, at in _limits(one).items()} | limits
