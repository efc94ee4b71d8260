"""DeepSeek-VL 7B (hybrid: SAM at high and SigLIP at low resolution): any frame takes 576 tokens."""

from collections.abc import Sequence

import torch

from model_adapters.hf.adapter import CheckpointAdapter
from model_adapters.hf.families.plain import PlainFamily
from model_adapters.hf.family import Pixels


class DeepseekVLFamily(PlainFamily):
    """The family of DeepSeek-VL hybrid."""

    def features_of(self, frames: Sequence[Pixels]) -> list[torch.Tensor]:
        """Return the aligned features of both vision towers for each frame, (tokens, hidden)."""
        return self._encoded(frames, "pixel_values", "high_res_pixel_values")


class DeepseekVL(CheckpointAdapter):
    """The adapter `deepseek-vl`."""

    family = DeepseekVLFamily
    model_types = ("deepseek_vl_hybrid",)
