"""Models in real vLLM; `make test-vllm` makes an environment that has it."""

import importlib.util

import pytest

from ...asking import load_with


@pytest.fixture(scope="session", autouse=True)
def installed():
    """Skips where vLLM is not installed."""
    if importlib.util.find_spec("vllm") is None:
        pytest.skip("vLLM is not installed (make test-vllm makes an environment with it)")


@pytest.fixture
def start(checkpoints, monkeypatch):
    """Starts a model of a tiny checkpoint in vLLM, and ends it with the test."""
    monkeypatch.setenv("VLLM_CPU_KVCACHE_SPACE", "1")
    started = []

    def start(family="qwen2.5-vl", name=None, **options):
        usual = {"pretrained": checkpoints[family], "dtype": "float32", "enforce_eager": True}
        started.append(load_with(f"{name or family}@vllm", **usual | options))
        return started[-1]

    yield start
    for model in started:
        model.close()
