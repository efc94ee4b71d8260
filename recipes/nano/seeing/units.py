"""What the vision tower sees in each part of a frame: a unit for each role and type.

The first layer of the tower's merger has these units, and the second one turns them into features.
So a label has one place: a type can be taken for another by exchanging units, and what is seen is
read off without another layer.
"""

from collections.abc import Iterable
from enum import IntEnum

from infthor_eval.household.wording import canonical_type


class Role(IntEnum):
    """What is said of a type: it is there, in the hand, open, or what something loose is in."""

    SHOWN = 0
    HELD = 1
    OPEN = 2
    AROUND = 3


class Units:
    """Names of the units, role by role.

    Args:
        types: object types; those that people do not tell from another count as that one.

    Attributes:
        types: the types, sorted.
    """

    def __init__(self, types: Iterable[str]) -> None:
        self.types = tuple(sorted({canonical_type(name) for name in types}))
        self._index = {name: at for at, name in enumerate(self.types)}

    def __len__(self) -> int:
        """Return the number of units."""
        return len(Role) * len(self.types)

    def index(self, object_type: str) -> int:
        """Return a type's index in `types`, or -1 if it has no units."""
        return self._index.get(canonical_type(object_type), -1)
