"""The actions of the protocol, one module per theme; importing this package registers them all.

To add a simulator action: a function with `@action` here (`modes=` for some agent modes alone), and
its line in `infthor_sim/ACTIONS.md`.
"""

from importlib import import_module
from pkgutil import iter_modules

from infthor_sim.actions.registry import Action, action_names, bind

__all__ = ["Action", "action_names", "bind"]

for _module in iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")
