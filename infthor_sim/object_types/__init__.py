"""The types of objects: one record each, in tables by theme.

To add an object type: a record here; if a plain box is not enough, a function with `@draws` in
`infthor_sim/render/shapes/`, whose name is the record's `shape`.
"""

from infthor_sim.object_types.catalogue import OBJECT_TYPES, allowed_in, type_named
from infthor_sim.object_types.record import ObjectType

__all__ = ["OBJECT_TYPES", "ObjectType", "allowed_in", "type_named"]
