"""What the plugin changes in vLLM: forms of weights, and what processors remember."""

import importlib
import sys
from types import ModuleType, SimpleNamespace

import pytest
import torch
from transformers.processing_utils import ProcessorMixin

from model_adapters.vllm import plugin

HIDDEN, INNER, EXPERTS = 8, 6, 3


class Model:
    """Stands for a model of vLLM: keeps the weights that it is given."""

    config = SimpleNamespace(get_text_config=lambda: SimpleNamespace(hidden_size=HIDDEN))
    vision_tower = SimpleNamespace()

    def load_weights(self, weights):
        return dict(weights)


@pytest.fixture
def registered(monkeypatch):
    """The class of the model after `register`; any name of vLLM's is one."""
    model = type("Model", (Model,), {"load_weights": Model.load_weights})
    for name in ("vllm", "vllm.model_executor", "vllm.model_executor.models"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    for module, name in plugin._MODELS.items():
        path = f"vllm.model_executor.models.{module}"
        monkeypatch.setitem(sys.modules, path, ModuleType(path))
        setattr(importlib.import_module(path), name, model)
    monkeypatch.setattr(ProcessorMixin, "_merge_kwargs", lambda self, of_call, **kwargs: kwargs)
    monkeypatch.setenv(plugin.ACTIVE, "1")
    plugin.register()
    yield model


@pytest.mark.parametrize("is_exchanged", [False, True], ids=["published", "saved anew"])
def test_experts_arrive_as_published(registered, is_exchanged):
    published = {
        "model.layers.0.mlp.experts.gate_up_proj": torch.randn(EXPERTS, HIDDEN, 2 * INNER),
        "model.layers.0.mlp.experts.down_proj": torch.randn(EXPERTS, INNER, HIDDEN),
        "model.layers.0.mlp.gate.weight": torch.randn(EXPERTS, HIDDEN),
    }
    given = {
        name: weight.transpose(1, 2) if is_exchanged and name.endswith("_proj") else weight
        for name, weight in published.items()
    }
    loaded = registered().load_weights(given.items())
    assert loaded.keys() == published.keys()
    assert all(torch.equal(loaded[name], weight) for name, weight in published.items())


def test_weights_of_a_tower_with_its_own_level_get_it(registered):
    model = registered()
    model.vision_tower = SimpleNamespace(vision_model=None)
    assert [*model.load_weights([("vision_tower.encoder.a", 1)])] == [
        "vision_tower.vision_model.encoder.a"
    ]


def test_a_processor_forgets_what_it_was_loaded_by(registered):
    of_call = SimpleNamespace(_defaults={"images_kwargs": {"use_fast": False, "size": 3}})
    merged = ProcessorMixin._merge_kwargs(None, of_call, text=1)
    assert merged == {"text": 1}
    assert of_call._defaults == {"images_kwargs": {"size": 3}}


def test_elsewhere_vllm_stays_as_it_is(monkeypatch):
    monkeypatch.delenv(plugin.ACTIVE, raising=False)
    before = ProcessorMixin._merge_kwargs
    plugin.register()
    assert ProcessorMixin._merge_kwargs is before
