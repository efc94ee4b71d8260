"""OpenVLA's network: what it is asked, what it sees, and that its cache changes nothing."""

import numpy as np
import pytest
import torch
from PIL import Image

from infthor_eval.formats.frames import FrameRef
from model_adapters.policies.decoding import embed_ids
from model_adapters.policies.openvla.network import OpenVLANetwork, prompt, prompt_ids
from model_adapters.policies.openvla.vision import Tower, TowerShape
from model_adapters.policies.preprocessing import crop_centre, normalise, resize

from ...asking import load_saved


@pytest.fixture
def network(policies):
    port = policies["openvla"]._network
    assert isinstance(port, OpenVLANetwork)
    return port


def test_the_prompt_is_the_one_of_training_in_lower_case():
    assert (
        prompt("Pick up the Mug")
        == "In: What action should the robot take to pick up the mug?\nOut:"
    )


def test_the_space_before_actions_ends_the_prompt_once(network):
    ids = prompt_ids(network.tokenizer, "pick up the mug")
    assert ids[-1] == 29_871
    assert ids.count(29_871) == 1
    assert ids[0] == network.tokenizer.token_to_id("<s>")
    assert network.tokenizer.decode(ids[1:-1]) == prompt("pick up the mug")


def test_frames_are_squashed_by_pil_and_normalised_by_channel():
    image = Image.new("RGB", (300, 200), (255, 0, 51))
    pixels = resize(image, 224)
    assert pixels.shape == (3, 224, 224)
    assert pixels[:, 100, 100].tolist() == pytest.approx([1.0, 0.0, 0.2])
    seen = normalise(pixels, (0.5, 0.25, 0.0), (0.5, 0.25, 0.1))
    assert seen[:, 0, 0].tolist() == pytest.approx([1.0, -1.0, 2.0])


def test_a_crop_is_the_middle_nine_tenths_of_the_area_as_tensorflow_makes_it():
    ramps = np.zeros((101, 201, 3), dtype=np.uint8)
    ramps[..., 0] = np.arange(201)
    ramps[..., 1] = np.arange(101)[:, None]
    cropped = np.asarray(crop_centre(Image.fromarray(ramps), 56))
    side = 0.9**0.5
    for channel, length in ((0, 201), (1, 101)):
        ends = (length - 1) * (1 - side) / 2, (length - 1) * (1 + side) / 2
        expected = np.floor(np.linspace(*ends, 56) * 255.5 / 255)
        line = cropped[0, :, 0] if channel == 0 else cropped[:, 0, 1]
        assert line.tolist() == expected.tolist()
    assert (cropped[..., 2] == 0).all()
    for level in (0, 1, 127, 254, 255):  # uniform frames stay as they are
        plain = Image.new("RGB", (30, 20), (level, level, level))
        assert crop_centre(plain, 8).getextrema() == ((level, level),) * 3


def test_frames_are_cropped_where_the_option_says_so(policy_checkpoints, tmp_path):
    noise = np.random.default_rng(0).integers(0, 256, (224, 224, 3), dtype=np.uint8)
    whole, cropped = tmp_path / "whole.png", tmp_path / "cropped.png"
    Image.fromarray(noise).save(whole)
    crop_centre(Image.fromarray(noise), 56).save(cropped)
    plain, cropping = (
        load_saved("openvla", policy_checkpoints["openvla"], center_crop=crops)
        for crops in (False, True)
    )
    steps = [policy.act(FrameRef(whole), "pick up the mug") for policy in (plain, cropping)]
    assert steps[0] != steps[1] == plain.act(FrameRef(cropped), "pick up the mug")
    assert "center_crop" not in plain.identity()
    assert cropping.identity() == plain.identity() | {"center_crop": True}


@pytest.mark.parametrize("kind", ["dinov2", "siglip"])
def test_a_tower_gives_features_of_patches_alone_in_reading_order(kind):
    torch.manual_seed(0)
    tower = Tower(TowerShape(kind, 16, 3, 2, 24), 56)
    for parameter in tower.parameters():
        torch.nn.init.normal_(parameter, std=0.3)
    pixels = torch.zeros(1, 3, 56, 56)
    changed = pixels.clone()
    changed[..., :14, 42:] = 1.0  # the fourth patch of the first row
    assert len(tower.blocks) == 2  # the last of three is not run
    tower.blocks = torch.nn.ModuleList()  # so that patches see nothing of each other
    difference = (tower(changed) - tower(pixels)).abs().sum(dim=-1)[0]
    assert difference.shape == (16,)
    assert difference.nonzero().flatten().tolist() == [3]


@torch.inference_mode()
def test_actions_with_a_cache_are_those_of_reading_all_anew(network, plain_frames):
    """The patches go in behind the begin token; every token is chosen from the whole sequence so
    far."""
    weights, model = network.weights, network.weights.language_model
    image = plain_frames[1].load()
    patches = weights.projector(weights.vision_backbone(resize(image, 56)[None]))
    assert patches.shape == (1, 16, 64)
    ids = prompt_ids(network.tokenizer, "pick up the mug")
    written = []
    for _ in range(7):
        text = embed_ids(model, [*ids, *written])
        scores = model(inputs_embeds=torch.cat([text[:, :1], patches, text[:, 1:]], dim=1)).logits[
            0, -1
        ]
        written.append(31_744 + int(scores[31_744:32_000].argmax()))
    assert len(set(written)) > 1
    expected = network.bins.decode(written)
    assert (network.predict(image, "pick up the mug", constrained=True) == expected).all()
