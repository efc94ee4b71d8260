"""Adapters of families whose checkpoints are loaded: a class per family with nothing but its settings."""

from typing import ClassVar

from infthor_eval.errors import ModelError
from model_adapters.engine.checkpoint import load_checkpoint, locate
from model_adapters.engine.family import MakeFamily
from model_adapters.engine.model import TransformersModel
from model_adapters.engine.options import CheckpointOptions

__all__ = ["CheckpointAdapter"]


class CheckpointAdapter:
    """Base of adapters that load a checkpoint of one family.

    Attributes:
        Options: the family's options, with its usual checkpoint as default.
        family: makes the family of a model, an image processor and a tokenizer.
        model_types: the `model_type`s of configs that it runs.
    """

    Options: ClassVar[type] = CheckpointOptions
    family: ClassVar[MakeFamily]
    model_types: ClassVar[tuple[str, ...]]

    @classmethod
    def build(cls, name: str, options: CheckpointOptions, seed: int) -> TransformersModel:  # noqa: ARG003
        """Load a checkpoint; nothing in it is random.

        Raises:
            ModelError: it cannot be loaded.
        """
        source = locate(options)
        found = source.config.model_type
        if found not in cls.model_types:
            raise ModelError(
                f"{options.pretrained} is a {found} checkpoint, not {' or '.join(cls.model_types)}; try hf-vlm"
            )
        return TransformersModel(name, load_checkpoint(source, cls.family), options)
