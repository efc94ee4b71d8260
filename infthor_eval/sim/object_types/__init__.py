"""The types of objects: one record each, in tables by theme; adding a type is adding a record."""

from infthor_eval.sim.object_types.catalogue import OBJECT_TYPES, allowed_in, type_named
from infthor_eval.sim.object_types.record import ObjectType

__all__ = ["OBJECT_TYPES", "ObjectType", "allowed_in", "type_named"]
