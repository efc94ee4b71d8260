"""Classes and functions by name: a built-in table first, then entry points of other packages.

They are imported only when they are asked for, so that `--help` stays quick.
"""

import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from infthor_eval.errors import STOPS, UsageError, describe_exception, in_one_line, unknown_name


@dataclass(frozen=True)
class PluginTable:
    """Classes of one kind by name.

    Attributes:
        kind: the kind in words ("suite"), for messages.
        group: entry point group in which other packages name theirs, as "module:Class".
        built_in: "module:Class" of each class of this package, by name.
        docs: the page of the documentation that says how to write one.
    """

    kind: str
    group: str
    built_in: Mapping[str, str]
    docs: str

    @property
    def names(self) -> tuple[str, ...]:
        """All names, the built-in ones first."""
        return tuple(dict.fromkeys([*self.built_in, *self.entry_points()]))

    def entry_points(self) -> dict[str, EntryPoint]:
        """Return the entry points of other packages by name."""
        return {point.name: point for point in entry_points(group=self.group)}

    def load(self, name: str, protocol: type) -> Any:
        """Import the class of a name; one of another package must have the members of the
        protocol, or of the base class."""
        if name in self.built_in:  # first: no package can change what a built-in name means
            return import_target(self.built_in[name])
        point = self.entry_points().get(name)
        if point is None:
            raise unknown_name(self.kind, name, self.names)
        problem = f"the {self.kind} {name} cannot be imported from {point.value}"
        hint = "fix its package, or uninstall it"
        try:
            loaded = import_target(point.value)
        except (ImportError, AttributeError) as error:
            raise UsageError(f"{problem} ({in_one_line(error)}); {hint}") from error
        except STOPS:
            raise
        except BaseException as error:  # its module is anybody's code
            raise UsageError(f"{problem} ({describe_exception(error)}); {hint}") from error
        members = (*protocol.__annotations__, *vars(protocol))
        public = dict.fromkeys(member for member in members if not member.startswith("_"))
        missing = [member for member in public if not hasattr(loaded, member)]
        if missing:
            raise UsageError(
                f"the {self.kind} {name} of another package lacks {', '.join(missing)}; see "
                f"{self.docs}"
            )
        return loaded


def import_target(target: str) -> Any:
    """Import what "module:Class" names."""
    module, _, attributes = target.partition(":")
    return reduce(getattr, attributes.split("."), importlib.import_module(module))
