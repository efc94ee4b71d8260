"""The types of objects: one record each, in tables by theme.

Adding a type is adding a record. One without a `shape` is drawn as a plain box; a new shape is one function in
`render/shapes` under `@draws`, which the record names.
"""

from infthor_eval.sim.object_types.catalogue import OBJECT_TYPES, allowed_in, type_named
from infthor_eval.sim.object_types.record import ObjectType

__all__ = ["OBJECT_TYPES", "ObjectType", "allowed_in", "type_named"]
