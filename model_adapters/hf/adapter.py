"""Base of the adapters of model families, whose classes have nothing but settings."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Any, ClassVar, TypeVar

import torch
from PIL import Image

from infthor_eval.errors import ModelError, wrap_errors
from model_adapters.hf.cached.model import TransformersModel
from model_adapters.hf.family import MakeFamily
from model_adapters.hf.loading.checkpoint import LocatedCheckpoint, load_checkpoint, locate
from model_adapters.options.checkpoints import CheckpointOptions, CheckpointReading

_SAMPLE = (300, 300)  # width and height of frames in the published data

R = TypeVar("R", bound=CheckpointReading)


class CheckpointAdapter:
    """Base of adapters that load a checkpoint of one family.

    Attributes:
        Options: options of the family, with its default checkpoint.
        family: builds the family of a model.
        model_types: supported values of `model_type` in configs.
    """

    Options: ClassVar[type] = CheckpointOptions
    family: ClassVar[MakeFamily]
    model_types: ClassVar[tuple[str, ...]]

    @classmethod
    def build(
        cls,
        name: str,
        options: CheckpointOptions,
        seed: int,  # noqa: ARG003
    ) -> TransformersModel:
        """Load a checkpoint; the seed is not used."""
        return load_model(name, cls.locate(options), cls.family)

    @classmethod
    def locate(cls, options: R) -> LocatedCheckpoint[R]:
        """Find a checkpoint of this family, for any engine."""
        located = locate(options)
        require_model_type(located, cls.model_types)
        return located


def require_model_type(located: LocatedCheckpoint[Any], model_types: Sequence[str]) -> None:
    """Refuse a checkpoint of another `model_type`."""
    model_type = located.config.model_type
    if model_type not in model_types:
        raise ModelError(
            f"{located.options.pretrained} is a {model_type} checkpoint, not "
            f"{' or '.join(model_types)}; try hf-vlm"
        )


def load_model(
    name: str, located: LocatedCheckpoint[CheckpointOptions], family: MakeFamily
) -> TransformersModel:
    """Load a checkpoint of a known family and test it on one frame."""
    loaded = load_checkpoint(located, family)
    pretrained = located.options.pretrained
    with wrap_mismatch_errors(pretrained), torch.inference_mode():
        n_slots = loaded.family.frame_ids(_SAMPLE).count(loaded.family.slot_id)
        n_features = len(loaded.family.features([Image.new("RGB", _SAMPLE)])[0])
    if n_slots != n_features:
        raise ModelError(
            f"{pretrained}: the processor makes {n_slots} image tokens of one frame and the model "
            f"{n_features} features; they do not belong to one checkpoint"
        )
    return TransformersModel(name, loaded, located.options)


def wrap_mismatch_errors(pretrained: str) -> AbstractContextManager[None]:
    """Turn errors of a model on the pixels or tokens of another checkpoint's processor into one
    line.
    """
    # Any error is possible: the processor's settings come from a file and end up in arithmetic and
    # shapes.
    problem = f"{pretrained}: the model fails on what the processor makes of a frame"
    hint = "do they belong to one checkpoint?"
    return wrap_errors(problem, hint, catch=Exception, raise_as=ModelError)
