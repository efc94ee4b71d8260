"""The shapes of the types of objects: assemblies of primitives in the object's box."""

from infthor_eval.sim.render.shapes.catalogue import shape

__all__ = ["shape"]
