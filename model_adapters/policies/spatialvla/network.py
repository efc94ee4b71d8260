"""SpatialVLA's network: patches with 3D positions, then a Gemma 2 that predicts action tokens."""

import re
from dataclasses import dataclass
from typing import Any

import torch
from PIL import Image
from tokenizers import Tokenizer
from torch import nn
from transformers import (
    DynamicCache,
    Gemma2ForCausalLM,
    SiglipVisionModel,
    ZoeDepthForDepthEstimation,
)

from infthor_eval.errors import ModelError
from model_adapters.hf.cached.kv_cache import cache_arguments
from model_adapters.policies.decoding import decode_greedily, embed_ids
from model_adapters.policies.preprocessing import normalise, resize
from model_adapters.policies.spatialvla.actions import SpatialBins
from model_adapters.policies.spatialvla.camera import thor_intrinsics
from model_adapters.policies.spatialvla.config import SpatialVLAConfig
from model_adapters.policies.spatialvla.ego3d import Ego3DEmbedding, back_project, estimate_depth
from model_adapters.policies.statistics import Actions
from model_adapters.policies.weights import Layout

_HALF = (0.5, 0.5, 0.5)
_IMAGE = "<image>"
_BEGIN = "<bos>"
_LM_HEAD = "language_model.lm_head.weight"


# Names of parameters in transformers 5 and in SpatialVLA's checkpoints, which transformers 4.47
# wrote. transformers has these renamings too, but applies them only to whole models that it knows:
# the parts would keep their old names, and a loader that is not strict would leave ZoeDepth random
# without a warning.
_SIGLIP = "vision_tower."
_BEIT = "vision_zoe_model.backbone."
_BEIT_RENAMES = (
    (r"^beit\.embeddings\.", "embeddings."),
    (r"^beit\.layers\.(\d+)\.", r"encoder.layer.\1."),
    (r"\.attention\.q_proj\.", ".attention.attention.query."),
    (r"\.attention\.k_proj\.", ".attention.attention.key."),
    (r"\.attention\.v_proj\.", ".attention.attention.value."),
    (r"\.attention\.o_proj\.", ".attention.output.dense."),
    (r"\.relative_position_bias\.", ".attention.attention.relative_position_bias."),
    (r"\.mlp\.fc1\.", ".intermediate.dense."),
    (r"\.mlp\.fc2\.", ".output.dense."),
)


def prompt(instruction: str) -> str:
    """Return SpatialVLA's prompt."""
    return f"What action should the robot take to {instruction}?"


class _SpatialVLAProjector(nn.Module):
    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.linear = nn.Linear(inputs, outputs)


class SpatialVLAWeights(nn.Module):
    """All modules with weights."""

    def __init__(self, config: SpatialVLAConfig, attn_implementation: str) -> None:
        super().__init__()
        text = config.text()
        vision = config.vision()
        zoe = config.zoe()
        parts: tuple[Any, ...] = (text, vision, zoe, zoe.backbone_config)
        for part in parts:
            part._attn_implementation = attn_implementation
        self.vision_tower = SiglipVisionModel(vision)
        self.vision_zoe_model = ZoeDepthForDepthEstimation(zoe)
        self.position_embedding_3d = Ego3DEmbedding(
            config.ego3d_patch_reso**2, config.n_freqs, vision.hidden_size
        )
        self.multi_modal_projector = _SpatialVLAProjector(vision.hidden_size, config.projection_dim)
        self.language_model = Gemma2ForCausalLM(text)
        self.spatial_embed_tokens = nn.Embedding(config.spatial_token_num, text.hidden_size)

    @property
    def has_tied_head(self) -> bool:
        """True if the embeddings and the output head share their weights."""
        return bool(self.language_model.config.tie_word_embeddings)

    def layout(self) -> Layout:
        """Return the layout of the checkpoint; all of its keys are used."""
        return Layout.of(
            self,
            lambda name: None if self.has_tied_head and name == _LM_HEAD else checkpoint_key(name),
            {},
        )

    @torch.inference_mode()
    def place_action_embeddings(self) -> None:
        """Copy the embeddings of action tokens, which have a key, into the vocabulary's."""
        model = self.language_model
        spatial = self.spatial_embed_tokens.weight
        model.model.embed_tokens.weight[-len(spatial) :] = spatial
        if self.has_tied_head:
            model.lm_head.weight = model.model.embed_tokens.weight
        del self.spatial_embed_tokens


@dataclass(frozen=True)
class View:
    """Image sizes and camera.

    Attributes:
        image_size: width and height that frames are squashed to, in pixels.
        patch: side of a patch in pixels.
        resolution: points along each side of a patch.
        zoe_size: width and height of the images for depth estimation.
        intrinsics: camera intrinsics of all frames, (3, 3), or None to derive them from the field
            of view.
        field_of_view: vertical field of view in degrees, or None.
    """

    image_size: int
    patch: int
    resolution: int
    zoe_size: int
    intrinsics: torch.Tensor | None
    field_of_view: float | None

    def camera(self, size: tuple[int, int]) -> torch.Tensor:
        """Return the intrinsics, (3, 3), in pixels of the squashed image, for a frame of this width
        and height."""
        if self.intrinsics is not None:
            return self.intrinsics
        assert self.field_of_view is not None
        return thor_intrinsics(self.field_of_view, size, self.image_size)

    @property
    def n_patches(self) -> int:
        """Patches of a frame."""
        return (self.image_size // self.patch) ** 2


@dataclass(frozen=True)
class SpatialVLANetwork:
    """A loaded SpatialVLA.

    Attributes:
        weights: all modules, on their device.
        tokenizer: tokenizer of the language model.
        bins: conversion of action ids.
        chunk: steps of a chunk.
        image_id: id of the image tokens, which patches replace.
        view: image sizes and camera.
    """

    weights: SpatialVLAWeights
    tokenizer: Tokenizer
    bins: SpatialBins
    chunk: int
    image_id: int
    view: View

    def prompt_ids(self, instruction: str) -> list[int]:
        """Return one image token for each patch, followed by the ids of the prompt."""
        text = f"{_IMAGE * self.view.n_patches}{_BEGIN}{prompt(instruction)}\n"
        ids: list[int] = self.tokenizer.encode(text, add_special_tokens=False).ids
        if ids.count(self.image_id) != self.view.n_patches or ids[0] != self.image_id:
            raise ModelError(
                f"the tokenizer has no {_IMAGE} of id {self.image_id}; is it the checkpoint's own?"
            )
        return ids

    def features(self, image: Image.Image) -> torch.Tensor:
        """Return the patches as input of Gemma, (1, patches, hidden)."""
        weights = self.weights
        view = self.view
        weight = weights.multi_modal_projector.linear.weight
        # Like the original, pixels and intrinsics are rounded to the weights' type first.
        pixels = resize(image, view.image_size).to(weight.device, weight.dtype)[None]
        camera = view.camera(image.size).to(weight.device, weight.dtype)
        patches = weights.vision_tower(
            pixel_values=normalise(pixels, _HALF, _HALF)
        ).last_hidden_state
        points = back_project(
            estimate_depth(weights.vision_zoe_model, pixels, view.zoe_size),
            camera,
            view.patch,
            view.resolution,
        )
        # The original divides by the root of the width, because its Gemma scaled all inputs; now it
        # scales tokens only.
        return weights.multi_modal_projector.linear(patches + weights.position_embedding_3d(points))

    @torch.inference_mode()
    def predict(self, image: Image.Image, instruction: str, *, constrained: bool) -> Actions:
        """Return a chunk of actions; see `Network.predict`."""
        model = self.weights.language_model
        cache = DynamicCache(config=model.config)

        def logits(embeds: torch.Tensor) -> torch.Tensor:
            past = cache.get_seq_length()
            new = embeds.shape[1]
            # No position is masked: the prefix attends in both directions (PaliGemma), and actions
            # follow one by one.
            mask = embeds.new_zeros(1, 1, new, past + new)
            output = model(
                inputs_embeds=embeds,
                attention_mask={"full_attention": mask, "sliding_attention": mask},
                # PaliGemma counts from 1.
                position_ids=torch.arange(past + 1, past + new + 1, device=mask.device)[None],
                **cache_arguments(model, cache),
                logits_to_keep=1,
            )
            return output.logits[0, -1].float()

        def step(token: int) -> torch.Tensor:
            return logits(embed_ids(model, [token]))

        ids = self.prompt_ids(instruction)
        is_image = torch.tensor(ids, device=model.device) == self.image_id
        prefix = embed_ids(model, ids).masked_scatter(is_image[None, :, None], self.features(image))
        action = decode_greedily(
            logits(prefix), step, self.bins.action_ids * self.chunk, constrained=constrained
        )
        return self.bins.decode(action)


def checkpoint_key(name: str) -> str:
    """Return the key in a checkpoint of a parameter of the module."""
    if name.startswith(_SIGLIP) and not name.startswith(f"{_SIGLIP}vision_model."):
        return f"{_SIGLIP}vision_model.{name.removeprefix(_SIGLIP)}"
    if name.startswith(f"{_BEIT}beit."):
        part = name.removeprefix(_BEIT)
        for new, old in _BEIT_RENAMES:
            part = re.sub(new, old, part)
        return _BEIT + part
    return name
