"""Shapes of object types, a module per theme; importing this package registers all drawings."""

from importlib import import_module
from pkgutil import iter_modules

from infthor_sim.render.shapes.catalogue import shape

__all__ = ["shape"]

for _module in iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")
