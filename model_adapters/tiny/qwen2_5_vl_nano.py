"""The small trained Qwen2.5-VL that comes with the package; its model card is beside its weights.

`infthor-eval train --recipe tiny` trains it.
"""

from dataclasses import replace

from infthor_eval.storage.packaged import packaged_folder
from model_adapters.hf.adapter import CheckpointAdapter
from model_adapters.hf.cached.model import TransformersModel
from model_adapters.hf.families.qwen2_5_vl import Qwen25VLFamily
from model_adapters.options.checkpoints import CheckpointOptions
from model_adapters.options.families import Qwen25VLNanoOptions

__all__ = ["FOLDER", "Qwen25VLNano"]

FOLDER = "models/qwen2.5-vl-nano"


class Qwen25VLNano(CheckpointAdapter):
    """The adapter `qwen2.5-vl-nano`."""

    Options = Qwen25VLNanoOptions
    family = Qwen25VLFamily
    model_types = ("qwen2_5_vl",)

    @classmethod
    def build(cls, name: str, options: CheckpointOptions, seed: int) -> TransformersModel:
        """Load the checkpoint of the package, or another one of the same form.

        Raises:
            ModelError: the checkpoint cannot be loaded.
        """
        pretrained = options.pretrained or str(packaged_folder(FOLDER))
        return super().build(name, replace(options, pretrained=pretrained), seed)
