"""What an OpenVLA checkpoint's config says, as far as it is needed."""

from typing import Any

import msgspec
from transformers import LlamaConfig

from infthor_eval.errors import ModelError
from model_adapters.policies.openvla.vision import TOWERS, TowerShape

__all__ = ["OpenVLAConfig"]


class OpenVLAConfig(msgspec.Struct, frozen=True, kw_only=True):
    """`config.json`.

    Attributes:
        text_config: of the language model, where it differs from Llama-2-7B's.
        timm_model_ids: the two towers by timm's names: DINOv2, then SigLIP.
        timm_override_act_layers: other activations than timm's own; there are none in what is run here.
        image_sizes: of the two towers, in pixels.
        image_resize_strategy: how frames become square.
        use_fused_vision_backbone: whether there are two towers.
        norm_stats: statistics of actions by dataset.
        n_action_bins: ids that mean actions.
        pad_to_multiple_of: how many ids were added at the end of the vocabulary.
        vision_towers: sizes of the towers where they are not those of their names, as in our tiny twin; no published
            checkpoint has this.
    """

    text_config: dict[str, Any]
    timm_model_ids: list[str]
    timm_override_act_layers: tuple[str | None, ...] = (None, None)
    image_sizes: list[int]
    image_resize_strategy: str = "resize-naive"
    use_fused_vision_backbone: bool = True
    norm_stats: dict[str, Any] = {}
    n_action_bins: int = 256
    pad_to_multiple_of: int = 64
    vision_towers: list[TowerShape] | None = None

    def language(self, attn_implementation: str) -> LlamaConfig:
        """The language model's config."""
        config = LlamaConfig(**self.text_config)
        config._attn_implementation = attn_implementation
        return config

    def image_size(self, pretrained: str) -> int:
        """Width and height of both towers' images, in pixels.

        Raises:
            ModelError: the checkpoint wants frames prepared in a way that is not known here.
        """
        known = self.use_fused_vision_backbone and self.image_resize_strategy == "resize-naive"
        if not known or set(self.timm_override_act_layers) != {None} or len(set(self.image_sizes)) != 1:
            raise ModelError(
                f"{pretrained} has image_sizes={self.image_sizes}, image_resize_strategy={self.image_resize_strategy}, "
                f"use_fused_vision_backbone={self.use_fused_vision_backbone}, timm_override_act_layers="
                f"{self.timm_override_act_layers}; only the preparation of openvla/openvla-7b is known here"
            )
        return self.image_sizes[0]

    def towers(self, pretrained: str) -> tuple[TowerShape, TowerShape]:
        """Sizes of both towers, DINOv2's first.

        Raises:
            ModelError: there are others.
        """
        unknown = [name for name in self.timm_model_ids if name not in TOWERS]
        shapes = self.vision_towers or [TOWERS[name] for name in self.timm_model_ids if name in TOWERS]
        if unknown or [shape.kind for shape in shapes] != ["dinov2", "siglip"]:
            raise ModelError(
                f"{pretrained} sees by {self.timm_model_ids}, not by {list(TOWERS)}; it cannot be run here"
            )
        return shapes[0], shapes[1]
