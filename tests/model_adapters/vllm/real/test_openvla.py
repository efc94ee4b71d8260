"""OpenVLA in real vLLM: the actions of the native port, with the published towers and a tiny
language model."""

import copy
from dataclasses import replace

import msgspec
import pytest

from model_adapters import load
from model_adapters.policies.openvla.config import OpenVLAConfig
from model_adapters.policies.openvla.network import OpenVLAWeights, weights_layout
from model_adapters.policies.openvla.vision import TOWERS
from model_adapters.policies.weights import empty_parameters
from model_adapters.tiny.openvla import OpenVLATiny
from model_adapters.tiny.twin import HEAD, HIDDEN

pytest.importorskip("timm", reason="vLLM builds OpenVLA's towers with timm, which is not installed")
SIZE = 224  # of the published towers' frames, which vLLM has no others for


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A checkpoint of 3 GB in float32."""
    config = copy.deepcopy(dict(OpenVLATiny.twin.files["config.json"]))
    del config["vision_towers"]
    config["image_sizes"] = [SIZE, SIZE]
    heads = {"num_attention_heads": HIDDEN // HEAD, "num_key_value_heads": HIDDEN // HEAD}
    config["text_config"] |= {"hidden_size": HIDDEN, "max_position_embeddings": 2048, **heads}

    def layout():
        towers = tuple(TOWERS.values())
        with empty_parameters():
            weights = OpenVLAWeights(
                towers, SIZE, msgspec.convert(config, OpenVLAConfig).language("sdpa")
            )
        return weights_layout(weights, towers)

    checkpoint = tmp_path_factory.mktemp("openvla")
    files = {**OpenVLATiny.twin.files, "config.json": config}
    replace(OpenVLATiny.twin, files=files, layout=layout).save(checkpoint, seed=0)
    return checkpoint


def test_actions_are_those_of_the_native_port(folder, make_frames, monkeypatch):
    monkeypatch.setenv("VLLM_CPU_KVCACHE_SPACE", "1")
    options = {"pretrained": str(folder), "dtype": "float32"}
    ours = load("openvla@vllm", {**options, "enforce_eager": "true"}, 0)
    theirs = load("openvla", {**options, "device": "cpu"}, 0)
    requests = [
        (frame, text)
        for frame in make_frames(2, 300, 300)
        for text in ("pick up the Mug", "close the fridge")
    ]
    actions = [[each.act(frame, text) for frame, text in requests] for each in (ours, theirs)]
    ours.close()
    assert actions[0] == actions[1]
    assert len(set(actions[0])) > 1
