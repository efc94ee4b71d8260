"""The double in vLLM's place, and tiny checkpoints for it."""

import sys

import pytest

from ..asking import load_saved, load_with
from .double import Double


@pytest.fixture
def vllm(monkeypatch):
    """The double, found by whoever imports vLLM."""
    double = Double()
    # Else the adapter sets it for all tests to come.
    monkeypatch.setenv("VLLM_LOGGING_STREAM", "ext://sys.stderr")
    for name, module in double.modules().items():
        monkeypatch.setitem(sys.modules, name, module)
    return double


@pytest.fixture
def start(vllm, checkpoints):
    """Starts a model of a tiny checkpoint on the double."""

    def start(family="qwen2.5-vl", name=None, **options):
        settings = {"pretrained": checkpoints[family], "dtype": "float32", **options}
        return load_with(f"{name or family}@vllm", **settings)

    return start


@pytest.fixture(scope="session")
def in_process(checkpoints):
    """The same checkpoints as transformers runs them."""
    loaded = {}

    def get(family, name=None, **options):
        key = (family, str(sorted(options.items())))
        if key not in loaded:
            folder = checkpoints[family]
            loaded[key] = load_saved(
                name or family, options.pop("pretrained", folder), dtype="float32", **options
            )
        return loaded[key]

    yield get
    for model in loaded.values():
        model.close()
