"""The config of an OpenVLA checkpoint, as far as it is used."""

from typing import Any

import msgspec
from transformers import LlamaConfig

from infthor_eval.errors import ModelError
from model_adapters.policies.openvla.vision import TOWERS, TowerShape


class OpenVLAConfig(msgspec.Struct, frozen=True, kw_only=True):
    """`config.json`.

    Attributes:
        text_config: settings of the language model that differ from Llama-2-7B's.
        timm_model_ids: timm's names of the two towers: DINOv2, then SigLIP.
        timm_override_act_layers: activations that differ from timm's; only None is supported.
        image_sizes: image sizes of the two towers, in pixels.
        image_resize_strategy: method that makes frames square.
        use_fused_vision_backbone: true if there are two towers.
        norm_stats: statistics of actions by dataset.
        n_action_bins: number of action ids.
        pad_to_multiple_of: number of ids added at the end of the vocabulary.
        vision_towers: sizes of the towers if their names do not determine them, as in our tiny
            twin; published checkpoints do not have this.
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
        """Return the config of the language model."""
        config = LlamaConfig(**self.text_config)
        config._attn_implementation = attn_implementation
        return config

    def image_size(self, pretrained: str) -> int:
        """Return width and height of both towers' images, in pixels."""
        is_known = self.use_fused_vision_backbone and self.image_resize_strategy == "resize-naive"
        if (
            not is_known
            or set(self.timm_override_act_layers) != {None}
            or len(set(self.image_sizes)) != 1
        ):
            raise ModelError(
                f"{pretrained} has image_sizes={self.image_sizes}, "
                f"image_resize_strategy={self.image_resize_strategy}, "
                f"use_fused_vision_backbone={self.use_fused_vision_backbone}, "
                f"timm_override_act_layers={self.timm_override_act_layers}; only the preprocessing "
                "of openvla/openvla-7b is supported"
            )
        return self.image_sizes[0]

    def towers(self, pretrained: str) -> tuple[TowerShape, TowerShape]:
        """Return the sizes of both towers, DINOv2's first."""
        unknown = [name for name in self.timm_model_ids if name not in TOWERS]
        shapes = self.vision_towers or [
            TOWERS[name] for name in self.timm_model_ids if name in TOWERS
        ]
        if unknown or [shape.kind for shape in shapes] != ["dinov2", "siglip"]:
            raise ModelError(
                f"{pretrained} has the vision towers {self.timm_model_ids}; only {list(TOWERS)} "
                "are supported"
            )
        return shapes[0], shapes[1]
