"""The types of objects: one record each, in tables by theme.

To add a type, add a record. A type without a `shape` is drawn as a plain box. A new shape is a
function in `render/shapes` with `@draws`, whose name the record gives.
"""

from infthor_sim.object_types.catalogue import (
    FORMER_NAMES,
    OBJECT_TYPES,
    allowed_in,
    modern_type,
    type_named,
)
from infthor_sim.object_types.record import ObjectType

__all__ = ["FORMER_NAMES", "OBJECT_TYPES", "ObjectType", "allowed_in", "modern_type", "type_named"]
