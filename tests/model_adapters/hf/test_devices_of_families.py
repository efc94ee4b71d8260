"""Families that people bring, on devices without devices: another device, two of them, a disk, and
half precision."""

from dataclasses import replace

import accelerate
import pytest
import torch
from accelerate.hooks import AlignDevicesHook, add_hook_to_module

from infthor_eval.errors import ModelError
from model_adapters import load

from ..asking import up_to
from ..elsewhere import Seen, elsewhere, move

QUESTIONS = ("\nWhat?", "\nWhere was it?", "\nWho was there before that?")
BRING = (
    "qwen3_vl",
    "qwen3_vl_moe",
    "qwen3_5",
    "internvl",
    "gemma3",
    "gemma4",
    "glm46v",
    "mistral3",
    "llama4",
)
TOGETHER = [(family, "3") for family in BRING]
FIRST, SECOND = torch.device("meta", 0), torch.device("meta", 1)


def _asked(model, frames, new=4):
    talk = model.conversation()
    talk.append(*frames)
    return [reply.token_ids for reply in talk.replies([[text] for text in QUESTIONS], up_to(new))]


def _load(folder, batch_size="3", **settings):
    """A model that never ends its turn by itself."""
    options = {"pretrained": str(folder), "device": "cpu", "max_tokens": "0", "chunk_tokens": "40"}
    model = load("hf-vlm", {**options, "batch_size": batch_size, **settings}, seed=0)
    generation = replace(model._loaded.generation, end_ids=frozenset())
    model._loaded = replace(model._loaded, generation=generation)
    return model


def _forget(model):
    model._prefix.reset()
    model._embed.clear()


def _decoder(model):
    decoder = model._loaded.model.get_decoder()
    return decoder if hasattr(decoder, "layers") else decoder.model  # Llama 4's has a head, too


@pytest.mark.parametrize(("family", "batch_size"), [*TOGETHER, ("qwen3_vl", "1")])
def test_on_another_device_a_token_is_read_once(family, batch_size, tiny_family, frames):
    model, seen = _load(tiny_family(family), batch_size), Seen()
    here = _asked(model, frames[:2], 8)
    _forget(model)
    move(model._loaded.model, seen)
    reads = []
    with elsewhere(seen):
        _asked(model, frames[:2], 1)
        for new in (2, 8):
            seen.reads.clear()
            there = _asked(model, frames[:2], new)
            reads.append(seen.reads.total())
    assert there == here
    together = model.capabilities.batch_size > 1
    assert reads[1] - reads[0] == (8 - 2) * (1 if together else len(QUESTIONS))


class _Placed(AlignDevicesHook):
    """accelerate's hook, on a module whose weights are where they belong."""

    def init_hook(self, module):
        return module


def _spread(model, seen):
    """Place a model on two devices, as `device_map=auto` does: later layers, what follows them and
    a head of its own on the second one."""
    network, decoder = model._loaded.model, _decoder(model)
    move(network, seen, FIRST)
    layers, head = decoder.layers, network.get_output_embeddings()
    later = [*layers[len(layers) // 2 :], decoder.norm]
    if head.weight.held is not network.get_input_embeddings().weight.held:
        later.append(head)
    moved = set()
    skip = network._skip_keys_device_placement
    for part in later:
        move(part, seen, SECOND)
        add_hook_to_module(part, _Placed(execution_device=SECOND, skip_keys=skip))
        moved |= set(part.modules())
    for part in set(network.modules()) - moved - {network}:
        if part._parameters:
            add_hook_to_module(part, _Placed(execution_device=FIRST, skip_keys=skip))
    whole = _Placed(execution_device=FIRST, io_same_device=True, skip_keys=skip)
    add_hook_to_module(network, whole)


@pytest.mark.parametrize(
    ("family", "batch_size"),
    [*TOGETHER, ("qwen3_vl", "1"), ("qwen2_5_vl", "3"), ("llava_onevision", "3")],
)
def test_on_two_devices_replies_are_the_same(family, batch_size, tiny_family, frames):
    model, seen = _load(tiny_family(family), batch_size), Seen()
    here = _asked(model, frames[:2])
    _forget(model)
    _spread(model, seen)
    with elsewhere(seen):
        assert _asked(model, frames[:2]) == here
    kept = {layer.keys.device for layer in model._prefix.cache.layers if hasattr(layer, "keys")}
    # Gemma 4's later layers attend to the keys of earlier ones.
    assert SECOND in kept or family == "gemma4"


@pytest.mark.parametrize("family", ["qwen2_5_vl", "gemma3"])
def test_a_layer_that_has_no_room_is_read_from_the_disk(family, tiny_family, frames, tmp_path):
    model = _load(tiny_family(family))
    here = _asked(model, frames[:2])
    _forget(model)
    network, last = model._loaded.model, _decoder(model).layers[-1]
    name = next(name for name, module in network.named_modules() if module is last)
    accelerate.dispatch_model(
        network, {"": "cpu", name: "disk"}, main_device="cpu", offload_dir=tmp_path
    )
    assert all(weight.is_meta for weight in last.parameters())
    assert _asked(model, frames[:2]) == here


def test_no_room_for_the_embeddings_is_one_line(tiny_family):
    with pytest.raises(ModelError, match=r"device_map=meta has no room for the embeddings of .*4"):
        _load(tiny_family("gemma3"), device_map="meta")


@pytest.mark.parametrize("family", BRING)
def test_half_precision_answers_the_same_every_time(family, tiny_family, frames):
    model = _load(tiny_family(family), dtype="bfloat16")
    first = _asked(model, frames[:2])
    kept = {layer.keys.dtype for layer in model._prefix.cache.layers if hasattr(layer, "keys")}
    assert kept == {torch.bfloat16}
    _forget(model)
    assert _asked(model, frames[:2]) == first
