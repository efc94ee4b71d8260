"""SpatialVLA's network: patches that know where they lie, in front of a Gemma 2 that writes action tokens."""

from dataclasses import dataclass
from typing import Any

import torch
from PIL import Image
from tokenizers import Tokenizer
from torch import nn
from transformers import DynamicCache, Gemma2ForCausalLM, SiglipVisionModel, ZoeDepthForDepthEstimation

from infthor_eval.errors import ModelError
from model_adapters.policies.decoding import embedded, greedy
from model_adapters.policies.preprocessing import normalised, resized
from model_adapters.policies.spatialvla.actions import SpatialBins
from model_adapters.policies.spatialvla.camera import thor_intrinsics
from model_adapters.policies.spatialvla.config import SpatialVLAConfig
from model_adapters.policies.spatialvla.ego3d import Ego3DEmbedding, depth_of, points_of
from model_adapters.policies.spatialvla.keys import checkpoint_key
from model_adapters.policies.statistics import Actions
from model_adapters.policies.weights import Layout

__all__ = ["SpatialVLANetwork", "SpatialVLAWeights", "View", "prompt"]

_HALF = (0.5, 0.5, 0.5)
_IMAGE, _BEGIN = "<image>", "<bos>"
_LM_HEAD = "language_model.lm_head.weight"


def prompt(instruction: str) -> str:
    """What SpatialVLA is asked."""
    return f"What action should the robot take to {instruction}?"


class _SpatialVLAProjector(nn.Module):
    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.linear = nn.Linear(inputs, outputs)


class SpatialVLAWeights(nn.Module):
    """All that has weights; `layout` knows their names in a checkpoint.

    Args:
        config: the checkpoint's.
        attn_implementation: of all transformers in it.
    """

    def __init__(self, config: SpatialVLAConfig, attn_implementation: str) -> None:
        super().__init__()
        text, vision, zoe = config.text(), config.vision(), config.zoe()
        parts: tuple[Any, ...] = (text, vision, zoe, zoe.backbone_config)
        for part in parts:
            part._attn_implementation = attn_implementation
        self.vision_tower = SiglipVisionModel(vision)
        self.vision_zoe_model = ZoeDepthForDepthEstimation(zoe)
        self.position_embedding_3d = Ego3DEmbedding(config.ego3d_patch_reso**2, config.n_freqs, vision.hidden_size)
        self.multi_modal_projector = _SpatialVLAProjector(vision.hidden_size, config.projection_dim)
        self.language_model = Gemma2ForCausalLM(text)
        self.spatial_embed_tokens = nn.Embedding(config.spatial_token_num, text.hidden_size)

    @property
    def tied(self) -> bool:
        """Whether tokens are embedded and written by the same weights."""
        return bool(self.language_model.config.tie_word_embeddings)

    def layout(self) -> Layout:
        """The layout of the checkpoint of these weights; all of it is used."""
        return Layout.of(self, lambda name: None if self.tied and name == _LM_HEAD else checkpoint_key(name), {})

    @torch.inference_mode()
    def finish(self) -> None:
        """Put loaded embeddings in their places: action tokens have theirs apart from the vocabulary's."""
        model, spatial = self.language_model, self.spatial_embed_tokens.weight
        model.model.embed_tokens.weight[-len(spatial) :] = spatial
        if self.tied:
            model.lm_head.weight = model.model.embed_tokens.weight
        del self.spatial_embed_tokens


@dataclass(frozen=True)
class View:
    """How frames are looked at.

    Attributes:
        image_size: width and height that they are squashed to, in pixels.
        patch: side of a patch in pixels.
        resolution: points along each side of a patch.
        zoe_size: width and height of the images that depth is estimated on.
        intrinsics: (3, 3), of all frames; None where they follow from the field of view.
        field_of_view: vertical, in degrees.
    """

    image_size: int
    patch: int
    resolution: int
    zoe_size: int
    intrinsics: torch.Tensor | None
    field_of_view: float | None

    def camera(self, size: tuple[int, int]) -> torch.Tensor:
        """Intrinsics, (3, 3), in pixels of the squashed image, for a frame of this width and height."""
        if self.intrinsics is not None:
            return self.intrinsics
        assert self.field_of_view is not None
        return thor_intrinsics(self.field_of_view, size, self.image_size)

    @property
    def n_patches(self) -> int:
        """Of a frame."""
        return (self.image_size // self.patch) ** 2


@dataclass(frozen=True)
class SpatialVLANetwork:
    """A loaded SpatialVLA.

    Attributes:
        weights: on their device.
        tokenizer: of the language model.
        bins: what action ids mean.
        chunk: steps that are written at once.
        image_id: the id that patches replace.
        view: how frames are looked at.
    """

    weights: SpatialVLAWeights
    tokenizer: Tokenizer
    bins: SpatialBins
    chunk: int
    image_id: int
    view: View

    def prompt_ids(self, instruction: str) -> list[int]:
        """The ids of the prompt behind as many image tokens as there are patches.

        Raises:
            ModelError: the tokenizer writes others.
        """
        text = f"{_IMAGE * self.view.n_patches}{_BEGIN}{prompt(instruction)}\n"
        ids: list[int] = self.tokenizer.encode(text, add_special_tokens=False).ids
        if ids.count(self.image_id) != self.view.n_patches or ids[0] != self.image_id:
            raise ModelError(f"the tokenizer has no {_IMAGE} of id {self.image_id}; is it the checkpoint's own?")
        return ids

    def features(self, image: Image.Image) -> torch.Tensor:
        """Patches as Gemma sees them, (1, patches, hidden)."""
        weights, view = self.weights, self.view
        weight = weights.multi_modal_projector.linear.weight
        # Pixels and intrinsics are rounded to the weights' type before anything else, as the original does.
        pixels = resized(image, view.image_size).to(weight.device, weight.dtype)[None]
        camera = view.camera(image.size).to(weight.device, weight.dtype)
        seen = weights.vision_tower(pixel_values=normalised(pixels, _HALF, _HALF)).last_hidden_state
        points = points_of(
            depth_of(weights.vision_zoe_model, pixels, view.zoe_size), camera, view.patch, view.resolution
        )
        # Not divided by the root of the width as in the original: Gemma scales within its embedding now.
        return weights.multi_modal_projector.linear(seen + weights.position_embedding_3d(points))

    @torch.inference_mode()
    def predict(self, image: Image.Image, instruction: str, *, constrained: bool) -> Actions:
        """A chunk of actions; see `Network.predict`."""
        model = self.weights.language_model
        cache = DynamicCache(config=model.config)

        def logits(fed: torch.Tensor) -> torch.Tensor:
            past, new = cache.get_seq_length(), fed.shape[1]
            # Everything sees everything: the prefix is read in both directions, and what follows comes one by one.
            mask = fed.new_zeros(1, 1, new, past + new)
            output = model(
                inputs_embeds=fed,
                attention_mask={"full_attention": mask, "sliding_attention": mask},
                position_ids=torch.arange(past + 1, past + new + 1, device=mask.device)[None],  # counted from 1
                past_key_values=cache,
                use_cache=True,
                logits_to_keep=1,
            )
            return output.logits[0, -1].float()

        def step(token: int) -> torch.Tensor:
            return logits(embedded(model, [token]))

        ids = self.prompt_ids(instruction)
        places = torch.tensor(ids, device=model.device) == self.image_id
        prefix = embedded(model, ids).masked_scatter(places[None, :, None], self.features(image))
        written = greedy(logits(prefix), step, self.bins.legal * self.chunk, constrained=constrained)
        return self.bins.decode(written)
