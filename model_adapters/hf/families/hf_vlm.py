"""Any model of `AutoModelForImageTextToText` with a chat template, so that next month's model needs no code.

Models of the known families run as these. Of others, the processor tells what a frame's placeholder expands to, and the
model's `get_image_features` what goes into the slots; before the first reply, token ids and logits are compared with
what the processor and the plain model make of a sample, so that an architecture that works in another way is refused
instead of being run wrongly. With share_prefix=false it is run by its own processor and `generate`; the sample then
shows only that the two fit each other.
"""

import functools
import inspect
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import torch
import transformers
from PIL import Image
from transformers.models.auto.modeling_auto import MODEL_FOR_IMAGE_TEXT_TO_TEXT_MAPPING_NAMES

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.formats.frames import FrameRef
from model_adapters.hf.adapter import fitting, load_model
from model_adapters.hf.checkpoint import LocatedCheckpoint, load_checkpoint, loading, locate
from model_adapters.hf.families.deepseek_vl import DeepseekVLFamily
from model_adapters.hf.families.llava_onevision import LlavaOnevisionFamily
from model_adapters.hf.families.pixtral import PixtralFamily
from model_adapters.hf.families.plain import PlainFamily
from model_adapters.hf.families.qwen2_5_vl import Qwen25VLFamily
from model_adapters.hf.family import MakeFamily, Size
from model_adapters.hf.loaded import Loaded
from model_adapters.hf.model import TransformersModel
from model_adapters.hf.prompt import token_ids
from model_adapters.hf.uncached import UncachedModel, expanded, image_token, processed
from model_adapters.options.checkpoints import CheckpointReading
from model_adapters.options.families import HfVlmOptions
from model_adapters.protocols import Model, Part, Turn

__all__ = ["HfVlm", "ProcessorFamily", "known_family", "load_processor"]

_TOLERANCE = {torch.float32: 1e-3, torch.float64: 1e-3}  # of the largest logit; half precision is compared more loosely
_HALF_TOLERANCE = 0.1
_BLANK = (300, 300)  # width and height of an image that shows what the processor expands one to

R = TypeVar("R", bound=CheckpointReading)


class ProcessorFamily(PlainFamily):
    """Frames of a model whose processor knows what they expand to.

    Args:
        model: a transformers model with `get_image_features`.
        image_processor: its image processor.
        tokenizer: its tokenizer.
        processor: its processor.

    Raises:
        ModelError: the processor names no image token.
    """

    def __init__(self, model: Any, image_processor: Any, tokenizer: Any, processor: Any) -> None:
        super().__init__(model, image_processor, tokenizer)
        self._processor = processor
        self.placeholder_id = tokenizer.convert_tokens_to_ids(image_token(processor))

    def frame_ids(self, size: Size) -> tuple[int, ...]:
        """What the processor expands the placeholder of one image to."""
        return tuple(expanded(self._processor, Image.new("RGB", size, "gray")))

    def written_ids(self) -> tuple[int, ...]:
        """The placeholder, between markers where the config names some that the processor does not write itself."""
        markers = _markers(self._model.config)
        if markers is None or markers[0] in self.frame_ids(_BLANK):
            return (self.placeholder_id,)
        return (markers[0], self.placeholder_id, markers[1])

    def features(self, images: Sequence[Image.Image]) -> list[torch.Tensor]:
        """The model's own features, (slots, hidden), for each image."""
        compute = getattr(self._model, "get_image_features", None) or self._model.model.get_image_features
        takes = inspect.signature(compute).parameters
        found = []
        for image in images:
            inputs = {name: value for name, value in self._inputs([image]).items() if name in takes}
            pooled = compute(**inputs, return_dict=True).pooler_output
            parts = pooled if isinstance(pooled, list | tuple) else [pooled]
            found.append(torch.cat([part.reshape(-1, part.shape[-1]) for part in parts]))
        return found


def _markers(config: Any) -> tuple[int, int] | None:
    """The tokens that begin and end an image, as the families call them that have some in their configs."""
    for kind in ("vision", "image"):
        start, end = (getattr(config, f"{kind}_{side}_token_id", None) for side in ("start", "end"))
        if start is not None and end is not None:
            return start, end
    return None


class HfVlm:
    """The adapter `hf-vlm`."""

    Options = HfVlmOptions

    @classmethod
    def build(cls, name: str, options: HfVlmOptions, seed: int) -> Model:  # noqa: ARG003
        """Load a checkpoint; nothing in it is random.

        Raises:
            UsageError: no checkpoint was named.
            ModelError: it cannot be loaded, sees no images, is not of one piece, or cannot share prefixes.
        """
        located = cls.locate(name, options)
        known = known_family(located.config)
        if known is not None:
            return load_model(name, located, known)
        processor = load_processor(located)
        model: TransformersModel | UncachedModel
        loaded = load_checkpoint(located, functools.partial(ProcessorFamily, processor=processor))
        if options.share_prefix:
            model = TransformersModel(name, loaded, options)
        else:
            model = UncachedModel(name, loaded, processor, options)
        _try(model, loaded, processor, options.pretrained)
        return model

    @classmethod
    def locate(cls, name: str, options: R) -> LocatedCheckpoint[R]:
        """Find a checkpoint that sees images, for whichever engine.

        Raises:
            UsageError: no checkpoint was named.
            ModelError: there is none, or it sees no images.
        """
        if not options.pretrained:
            raise UsageError(f"{name} needs pretrained=..., a hub id or a folder")
        located = locate(options)
        model_type = located.config.model_type
        remote = options.trust_remote_code and "AutoModelForImageTextToText" in getattr(located.config, "auto_map", {})
        if model_type not in MODEL_FOR_IMAGE_TEXT_TO_TEXT_MAPPING_NAMES and not remote:
            raise ModelError(f"{options.pretrained} is a {model_type} checkpoint, which sees no images")
        return located


def known_family(config: Any) -> MakeFamily | None:
    """The family made for this architecture, if there is one."""
    families: dict[str, MakeFamily] = {
        "qwen2_5_vl": Qwen25VLFamily,
        "qwen2_vl": Qwen25VLFamily,
        "llava_onevision": LlavaOnevisionFamily,
        "deepseek_vl_hybrid": DeepseekVLFamily,
    }
    if config.model_type == "llava" and config.vision_config.model_type == "pixtral":
        return PixtralFamily
    return families.get(config.model_type)


def load_processor(located: LocatedCheckpoint[Any]) -> Any:
    """The checkpoint's processor of images and text, for families without code of their own.

    Raises:
        ModelError: it has none, or it cannot be loaded.
    """
    remote = {"trust_remote_code": located.options.trust_remote_code}
    with loading(located.options.pretrained):
        processor = transformers.AutoProcessor.from_pretrained(located.folder, **remote)
        processor.image_processor = transformers.AutoImageProcessor.from_pretrained(
            located.folder, backend="pil", **remote
        )
    if not hasattr(processor, "tokenizer"):
        raise ModelError(f"{located.options.pretrained} has no processor of images and text together")
    return processor


@torch.inference_mode()
def _try(model: TransformersModel | UncachedModel, loaded: Loaded, processor: Any, pretrained: str) -> None:
    """Run a sample by the processor and the plain model, and see that shared machinery makes the same of it.

    Raises:
        ModelError: model and processor do not fit, or the shared machinery gives other token ids or logits.
    """
    mend = f"{loaded.model.config.model_type} cannot be run with shared prefixes; use share_prefix=false"
    shared = None
    with tempfile.TemporaryDirectory() as folder, fitting(pretrained):
        turns = [Turn("user", _sample(Path(folder)))]
        inputs = processed(processor, loaded.template, turns)
        if isinstance(model, TransformersModel):
            pieces = model.pieces(turns)
            if list(token_ids(pieces)) != inputs["input_ids"][0].tolist():
                raise ModelError(f"token ids differ from the processor's: {mend}")
            shared = model.encode(pieces)
        weight = loaded.model.get_input_embeddings().weight
        plain = loaded.model(**inputs.to(weight.device, loaded.model.dtype)).logits[0, -1]
    tolerance = _TOLERANCE.get(loaded.model.dtype, _HALF_TOLERANCE) * plain.abs().max()
    if shared is not None and (shared - plain).abs().max() > tolerance:
        raise ModelError(f"logits differ from the plain model's: {mend}")


def _sample(folder: Path) -> tuple[Part, ...]:
    draw = np.random.default_rng(0)
    frames = []
    for number, (height, width) in enumerate([(300, 300), (200, 280)]):
        path = folder / f"{number}.png"
        Image.fromarray(draw.integers(0, 256, (height, width, 3), dtype=np.uint8)).save(path)
        frames.append(FrameRef(path))
    return "The first view:\n", frames[0], "RotateLeft", frames[1], frames[0], "\nWhat do you see?"
