"""Adapters of families whose checkpoints are loaded: a class per family with nothing but its settings."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import ClassVar, TypeVar

import torch
from PIL import Image

from infthor_eval.errors import ModelError, wrap_errors
from model_adapters.hf.checkpoint import LocatedCheckpoint, load_checkpoint, locate
from model_adapters.hf.family import MakeFamily
from model_adapters.hf.model import TransformersModel
from model_adapters.options.checkpoints import CheckpointOptions, CheckpointReading

__all__ = ["CheckpointAdapter", "fitting", "load_model"]

_SAMPLE = (300, 300)  # a frame's width and height in the published data

R = TypeVar("R", bound=CheckpointReading)


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
            ModelError: it cannot be loaded, or is not of one piece.
        """
        return load_model(name, cls.locate(options), cls.family)

    @classmethod
    def locate(cls, options: R) -> LocatedCheckpoint[R]:
        """Find a checkpoint of this family, for whichever engine.

        Raises:
            ModelError: there is none, or it is another family's.
        """
        located = locate(options)
        found = located.config.model_type
        if found not in cls.model_types:
            raise ModelError(
                f"{options.pretrained} is a {found} checkpoint, not {' or '.join(cls.model_types)}; try hf-vlm"
            )
        return located


def load_model(name: str, located: LocatedCheckpoint[CheckpointOptions], family: MakeFamily) -> TransformersModel:
    """Load a checkpoint of a known family and try it on one frame.

    Args:
        name: the registry's name.
        located: the checkpoint.
        family: makes the family of a model, an image processor and a tokenizer.

    Raises:
        ModelError: it cannot be loaded, or its processor makes of a frame what its model does not.
    """
    loaded, pretrained = load_checkpoint(located, family), located.options.pretrained
    with fitting(pretrained), torch.inference_mode():
        n_slots = loaded.family.frame_ids(_SAMPLE).count(loaded.family.slot_id)
        n_features = len(loaded.family.features([Image.new("RGB", _SAMPLE)])[0])
    if n_slots != n_features:
        raise ModelError(
            f"{pretrained}: the processor makes {n_slots} image tokens of one frame and the model {n_features} "
            "features; they do not belong to one checkpoint"
        )
    return TransformersModel(name, loaded, located.options)


@contextmanager
def fitting(pretrained: str) -> Iterator[None]:
    """Turn what a model says to the pixels or tokens of another checkpoint's processor into one line.

    Raises:
        ModelError: the model failed on them.
    """
    # Whatever it raises: settings of the processor come from a file, and end up in arithmetic and shapes.
    problem = f"{pretrained}: the model fails on what the processor makes of a frame"
    with wrap_errors(problem, "do they belong to one checkpoint?", catch=Exception, raise_as=ModelError):
        yield
