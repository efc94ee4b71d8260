"""DeepSeek-VL 7B (hybrid: SAM at high and SigLIP at low resolution): any frame takes 576 tokens."""

from collections.abc import Sequence

import torch
from PIL import Image

from model_adapters.hf.adapter import CheckpointAdapter
from model_adapters.hf.families.plain import PlainFamily
from model_adapters.options.families import DeepseekVLOptions

__all__ = ["DeepseekVL", "DeepseekVLFamily"]


class DeepseekVLFamily(PlainFamily):
    """The family of DeepSeek-VL hybrid."""

    def features(self, images: Sequence[Image.Image]) -> list[torch.Tensor]:
        """Return the aligned features of both vision towers for each image, (tokens, hidden)."""
        inputs = self._inputs(images)
        output = self._model.model.get_image_features(
            inputs["pixel_values"], inputs["high_res_pixel_values"], return_dict=True
        )
        return list(output.pooler_output)


class DeepseekVL(CheckpointAdapter):
    """The adapter `deepseek-vl`."""

    Options = DeepseekVLOptions
    family = DeepseekVLFamily
    model_types = ("deepseek_vl_hybrid",)
