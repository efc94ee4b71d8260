"""A scene's state as bytes, from which it comes back any number of times.

Pickled bytes are several times quicker to make and to read than copied objects.
"""

import copyreg
import io
import pickle
from collections.abc import Callable

import numpy as np

from infthor_sim.object_types import ObjectType, type_named
from infthor_sim.world import World


class SavedState:
    """A copy of a world and of the random numbers that its actions draw."""

    def __init__(self, world: World, random: np.random.Generator) -> None:
        buffer = io.BytesIO()
        pickler = pickle.Pickler(buffer, protocol=pickle.HIGHEST_PROTOCOL)
        pickler.dispatch_table = {**copyreg.dispatch_table, ObjectType: _reduce_type}
        pickler.dump((world, random))
        self._content = buffer.getvalue()

    def copy(self) -> tuple[World, np.random.Generator]:
        """Return the state anew; it shares nothing with earlier copies."""
        world, random = pickle.loads(self._content)
        return world, random


def _reduce_type(record: ObjectType) -> tuple[Callable[[str], ObjectType], tuple[str]]:
    """Have a type's record looked up again: it is never changed, so states can share it."""
    return type_named, (record.name,)
