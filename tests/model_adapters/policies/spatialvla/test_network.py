"""SpatialVLA's network: what it is asked, where its embeddings are, and that its cache changes
nothing."""

import pytest
import torch
from safetensors.torch import load_file

from infthor_eval.errors import ModelError
from model_adapters.policies.decoding import embed_ids
from model_adapters.policies.spatialvla.network import SpatialVLANetwork, prompt

from ...asking import load_saved

N_ACTIONS, N_PATCHES, HIDDEN = 8194, 16, 64


@pytest.fixture
def network(policies):
    result = policies["spatialvla"]._network
    assert isinstance(result, SpatialVLANetwork)
    return result


def test_the_prompt_stands_behind_the_image_tokens_and_ends_a_line(network):
    ids = network.prompt_ids("pick up the Mug")
    assert ids[:N_PATCHES] == [network.image_id] * N_PATCHES
    assert ids[N_PATCHES] == network.tokenizer.token_to_id("<bos>")
    text = network.tokenizer.decode(ids[N_PATCHES + 1 :])
    assert (
        text
        == "What action should the robot take to pick up the Mug?\n"
        == f"{prompt('pick up the Mug')}\n"
    )


def test_a_tokenizer_without_image_tokens_is_refused(network):
    other = SpatialVLANetwork(
        network.weights, network.tokenizer, network.bins, 4, network.image_id + 1, network.view
    )
    with pytest.raises(ModelError, match="the tokenizer has no <image> of id"):
        other.prompt_ids("x")


def test_action_tokens_have_the_embeddings_kept_apart_and_all_are_scaled(
    network, policy_checkpoints
):
    kept = load_file(policy_checkpoints["spatialvla"] / "model.safetensors")
    model = network.weights.language_model
    begin = network.bins.begin
    result = embed_ids(model, [5, begin, begin + N_ACTIONS - 1])[0]
    of_text = kept["language_model.model.embed_tokens.weight"][5]
    spatial = kept["spatial_embed_tokens.weight"]
    expected = torch.stack([of_text, spatial[0], spatial[-1]]) * HIDDEN**0.5
    torch.testing.assert_close(result, expected)
    # What writes tokens is not tied in the published checkpoint, and stays as it was.
    torch.testing.assert_close(model.lm_head.weight.data, kept["language_model.lm_head.weight"])


@torch.inference_mode()
def test_actions_with_a_cache_are_those_of_reading_all_anew(network, plain_frames):
    """Positions count from 1, the prefix is read in both directions, and what follows by what came
    before."""
    model, image = network.weights.language_model, plain_frames[1].load()
    ids = network.prompt_ids("pick up the mug")
    written = []
    for place in range(12):
        fed = embed_ids(model, [*ids, *written])
        fed[:, :N_PATCHES] = network.features(image)
        length = fed.shape[1]
        mask = torch.full((length, length), torch.finfo(torch.float32).min).triu(1)
        mask[: len(ids), : len(ids)] = 0
        output = model(
            inputs_embeds=fed,
            attention_mask={
                "full_attention": mask[None, None],
                "sliding_attention": mask[None, None],
            },
            position_ids=torch.arange(1, length + 1)[None],
        )
        legal = network.bins.action_ids[place % 3]
        written.append(legal.start + int(output.logits[0, -1, legal.start : legal.stop].argmax()))
    acted = network.predict(image, "pick up the mug", constrained=True)
    assert (acted == network.bins.decode(written)).all()


def test_the_camera_changes_what_is_seen(policy_checkpoints, plain_frames):
    seen = []
    for intrinsics in ("default", "thor:60", "thor:90"):
        policy = load_saved("spatialvla", policy_checkpoints["spatialvla"], intrinsics=intrinsics)
        assert policy.identity()["intrinsics"] == intrinsics
        with torch.inference_mode():
            seen.append(policy._network.features(plain_frames[0].load()))
    assert not torch.equal(seen[0], seen[1])
    assert not torch.equal(seen[1], seen[2])
