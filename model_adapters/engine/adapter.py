"""Adapters of families whose checkpoints are loaded: a class per family with nothing but its settings."""

from typing import ClassVar

from model_adapters.engine.checkpoint import load_checkpoint
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
        loaded = load_checkpoint(options, cls.family, cls.model_types, options.image_settings())
        return TransformersModel(name, loaded, options)
