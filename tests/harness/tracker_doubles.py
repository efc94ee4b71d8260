"""Doubles of wandb and trackio: they take the arguments that the real ones take, and remember them.

`tracker_signatures.json` has the names of the real ones' parameters, read from the releases that it
names.
"""

import io
import json
import types
from contextlib import nullcontext
from importlib.machinery import ModuleSpec
from inspect import Parameter, Signature
from pathlib import Path

SIGNATURES = json.loads((Path(__file__).parent / "tracker_signatures.json").read_text())


class Double:
    """A package, and what it was called with: `calls` has the name of each function and its
    arguments by name."""

    def __init__(self, package):
        self.calls = []
        self._signatures = SIGNATURES[package]
        self.module = types.ModuleType(package)
        self.module.__spec__ = ModuleSpec(package, None)
        self.module.__version__ = self._signatures["version"]

    def function(self, name, gives=None):
        """A function of the package with the real one's parameters."""
        names = self._signatures[name]
        signature = Signature(
            [Parameter(one, Parameter.POSITIONAL_OR_KEYWORD, default=None) for one in names]
        )

        def double(*args, **kwargs):
            self.calls.append((name, dict(signature.bind(*args, **kwargs).arguments)))
            return gives

        double.__signature__ = signature
        return double

    def of(self, name):
        """What a function was called with, each time."""
        return [arguments for called, arguments in self.calls if called == name]


def wandb():
    """The modules of a double of wandb by name, and the double."""
    double = Double("wandb")
    artifact = types.SimpleNamespace(
        new_file=double.function("new_file", gives=nullcontext(io.StringIO()))
    )
    table = types.SimpleNamespace(add_data=lambda *cells: double.calls.append(("add_data", cells)))
    run = types.SimpleNamespace(
        config=Config(double),
        summary=Config(double),
        log=double.function("log"),
        log_artifact=double.function("log_artifact"),
        finish=double.function("finish"),
    )
    module = double.module
    module.run = None
    module.init = double.function("init", gives=run)
    module.Artifact = double.function("Artifact", gives=artifact)
    module.Table = double.function("Table", gives=table)
    printer = types.ModuleType("wandb.sdk.lib.printer")
    printer.new_printer = lambda: None
    inner = {name: types.ModuleType(name) for name in ("wandb.sdk", "wandb.sdk.lib")}
    return {"wandb": module, **inner, "wandb.sdk.lib.printer": printer}, double


def trackio():
    """The modules of a double of trackio by name, and the double."""
    double = Double("trackio")
    module = double.module
    for name in ("init", "log", "Trace", "finish"):
        setattr(module, name, double.function(name))
    module.config = Config(double)
    return {"trackio": module}, double


class Config:
    """What takes settings; those must be JSON values."""

    def __init__(self, double):
        self._double = double

    def update(self, values, allow_val_change=None):
        self._double.calls.append(("update", json.loads(json.dumps(values))))
