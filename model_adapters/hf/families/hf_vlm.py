"""Any model of `AutoModelForImageTextToText` with a chat template, so that new models need no code.

A model of a known family runs as that family. For others, the processor says what a frame's
placeholder expands to, the model's `get_image_features` encodes it, and the model merges that into
the prompt by itself. With share_prefix=false it is run by its own processor and `generate`. When it
is loaded, samples show that it is run as its own code does it (`load_check`): an architecture that
works differently is refused instead of giving wrong results.
"""

import inspect
from collections.abc import Mapping, Sequence
from functools import cached_property, partial
from typing import Any, ClassVar, TypeVar

import torch
from PIL import Image
from transformers.models.auto.modeling_auto import MODEL_FOR_IMAGE_TEXT_TO_TEXT_MAPPING_NAMES

from infthor_eval.errors import ModelError, UsageError
from model_adapters.built_in import BUILT_IN
from model_adapters.hf.adapter import load_model, require_model_type
from model_adapters.hf.cached.model import TransformersModel
from model_adapters.hf.families.deepseek_vl import DeepseekVLFamily
from model_adapters.hf.families.llava_onevision import LlavaOnevisionFamily
from model_adapters.hf.families.load_check import check_loaded
from model_adapters.hf.families.pixtral import PixtralFamily
from model_adapters.hf.families.plain import PlainFamily, three_axis_positions
from model_adapters.hf.families.qwen2_5_vl import Qwen25VLFamily
from model_adapters.hf.family import ClipShape, MakeFamily, Pixels, Shape, Size
from model_adapters.hf.loading.checkpoint import LocatedCheckpoint, load_checkpoint, locate
from model_adapters.hf.loading.processors import load_processor
from model_adapters.hf.prompting.ahead import Ahead, PixelsAhead, read_pixels
from model_adapters.hf.prompting.embedding import Embed
from model_adapters.hf.prompting.features import FeatureCache
from model_adapters.hf.prompting.native import EncodedImage, NativeEmbedder
from model_adapters.hf.uncached import UncachedModel, expand_image_tokens, image_token
from model_adapters.options.checkpoints import CheckpointReading
from model_adapters.options.families import HfVlmOptions
from model_adapters.protocols import Model

# Inputs that say which tokens are of images, of which models make masks or positions.
_MASK_TYPES = ("token_type_ids", "mm_token_type_ids")
_BLANK = (300, 300)  # width and height of a sample image

R = TypeVar("R", bound=CheckpointReading)


class ProcessorFamily(PlainFamily):
    """A family whose processor expands frames and whose model merges them into the prompt."""

    def __init__(self, model: Any, image_processor: Any, tokenizer: Any, processor: Any) -> None:
        super().__init__(model, image_processor, tokenizer)
        self._tokenizer = tokenizer
        self._processor = processor
        self.placeholder_id = tokenizer.convert_tokens_to_ids(image_token(processor))
        self._blanks: dict[Size, Pixels] = {}

    @cached_property
    def mask_types(self) -> Mapping[str, Mapping[int, int]]:
        """Inputs that say which tokens attend to each other in both directions; see
        `MergingFamily`."""
        if hasattr(_core(self._model), "get_rope_index"):  # they are for the positions alone
            return {}
        return {name: self._types[name] for name in _MASK_TYPES if name in self._types}

    @cached_property
    def token_types(self) -> Mapping[str, Mapping[int, int]]:
        """Other inputs of one value for each token; see `MergingFamily`."""
        return {name: self._types[name] for name in self._types if name not in _MASK_TYPES}

    def make_embed(self, max_bytes: int, ahead: Ahead) -> Embed:
        """Return what prepares spans of prompts, with a cache of so many bytes of features."""
        pixels = PixelsAhead(partial(read_pixels, self), ahead)
        return NativeEmbedder(self._model, self, FeatureCache(pixels, self.encode, max_bytes))

    def frame_ids(self, size: Size) -> tuple[int, ...]:
        """Return the ids that the processor expands the placeholder of one image to."""
        return tuple(self._blank(size)["input_ids"][0].tolist())

    def template_ids(self, placeholder_id: int) -> tuple[int, ...]:
        """Return the placeholder, between the config's markers unless the processor adds them."""
        markers = _markers(self._model.config)
        if markers is None or markers[0] in self.frame_ids(_BLANK):
            return (placeholder_id,)
        return (markers[0], placeholder_id, markers[1])

    def encode(self, frames: Sequence[Pixels]) -> list[EncodedImage]:
        """Return the model's features of each prepared frame."""
        compute = _core(self._model).get_image_features
        parameters = inspect.signature(compute).parameters
        encoded = []
        for frame in frames:
            inputs = {
                name: value for name, value in self._inputs([frame]).items() if name in parameters
            }
            encoded.append(EncodedImage.of(compute(**inputs, return_dict=True)))
        return encoded

    def features_of(self, frames: Sequence[Pixels]) -> list[torch.Tensor]:
        """Return the embeddings for the slots of each frame, (slots, hidden), for training."""
        features = []
        for image in self.encode(frames):
            pooled = image.output.pooler_output
            parts = pooled if isinstance(pooled, list | tuple) else [pooled]
            features.append(torch.cat([part.reshape(-1, part.shape[-1]) for part in parts]))
        return features

    def positions(self, ids: torch.Tensor, shapes: Sequence[Shape], start: int) -> torch.Tensor:
        """Return consecutive positions, or those that the model's own rule gives."""
        core = _core(self._model)
        if not hasattr(core, "get_rope_index"):
            return super().positions(ids, shapes, start)
        sizes = [shape for shape in shapes if not isinstance(shape, ClipShape)]
        grids = [self._blank(size)["image_grid_thw"] for size in sizes]
        joined = torch.cat(grids) if grids else None
        return three_axis_positions(core, ids, self.slot_id, joined, start)

    def prepare(self, image: Image.Image) -> Pixels:
        """Return the output of the whole processor, which has settings for its image processor."""
        pixels: Pixels = expand_image_tokens(self._processor, [image])
        return pixels

    @cached_property
    def _types(self) -> dict[str, dict[int, int]]:
        """Return the types that the processor gives tokens of images and around them, by id, for
        each input of the model that has such."""
        accepted = {
            *inspect.signature(self._model.forward).parameters,
            *inspect.signature(_core(self._model).forward).parameters,
        }
        ids = self.template_ids(self.placeholder_id)
        text = "".join(self._tokenizer.convert_ids_to_tokens(list(ids)))
        blank = self._processor(
            text=[text],
            images=[Image.new("RGB", _BLANK)],
            add_special_tokens=False,
            return_tensors="pt",
        )
        written = blank["input_ids"][0].tolist()
        return {
            name: dict(zip(written, values[0].tolist(), strict=True))
            for name, values in blank.items()
            if name in accepted and name.endswith("token_type_ids")
        }

    def _blank(self, size: Size) -> Pixels:
        """Return what the processor makes of one image of a size, but for its pixels."""
        if size not in self._blanks:
            inputs = self.prepare(Image.new("RGB", size, "gray"))
            self._blanks[size] = {
                name: value for name, value in inputs.items() if not value.is_floating_point()
            }
        return self._blanks[size]


def _core(model: Any) -> Any:
    """Return the model without its output layer, which a few architectures do not have apart."""
    return getattr(model, "model", model)


def _markers(config: Any) -> tuple[int, int] | None:
    """Return the tokens that begin and end an image, by configs' names for them, or None."""
    for kind in ("vision", "image"):
        start = getattr(config, f"{kind}_start_token_id", None)
        end = getattr(config, f"{kind}_end_token_id", None)
        if start is not None and end is not None:
            return start, end
    return None


class HfVlm:
    """The adapter `hf-vlm`, and of models with a name of their own that run as it does."""

    Options: ClassVar[type] = HfVlmOptions

    @classmethod
    def build(cls, name: str, options: HfVlmOptions, seed: int) -> Model:  # noqa: ARG003
        """Load a checkpoint; the seed is not used."""
        located = cls.locate(name, options)
        family, processor = find_family(located)
        if processor is None:
            return load_model(name, located, family)
        model: TransformersModel | UncachedModel
        loaded = load_checkpoint(located, family)
        if options.share_prefix:
            model = TransformersModel(name, loaded, options)
        else:
            model = UncachedModel(name, loaded, processor, options)
        check_loaded(model, processor, options.pretrained)
        return model

    @classmethod
    def locate(cls, name: str, options: R) -> LocatedCheckpoint[R]:
        """Find a checkpoint of a vision-language model, for any engine."""
        if not options.pretrained:
            raise UsageError(f"{name} needs pretrained=..., a hub id or a folder")
        located = locate(options)
        model_type = located.config.model_type
        remote = options.trust_remote_code and "AutoModelForImageTextToText" in getattr(
            located.config, "auto_map", {}
        )
        if model_type not in MODEL_FOR_IMAGE_TEXT_TO_TEXT_MAPPING_NAMES and not remote:
            raise ModelError(
                f"{options.pretrained} is a {model_type} checkpoint, which has no vision"
            )
        named = BUILT_IN.get(name)
        if named is not None and named.model_types:
            require_model_type(located, named.model_types)
        return located


def find_family(located: LocatedCheckpoint[Any]) -> tuple[MakeFamily, Any]:
    """Return the family of a checkpoint, and its processor if there is no code for it."""
    family = family_of(located.config)
    if family is not None:
        return family, None
    processor = load_processor(located)
    return partial(ProcessorFamily, processor=processor), processor


def family_of(config: Any) -> MakeFamily | None:
    """Return the family of this architecture, or None if there is no code for it."""
    families: dict[str, MakeFamily] = {
        "qwen2_5_vl": Qwen25VLFamily,
        "qwen2_vl": Qwen25VLFamily,
        "llava_onevision": LlavaOnevisionFamily,
        "deepseek_vl_hybrid": DeepseekVLFamily,
    }
    if config.model_type == "llava" and config.vision_config.model_type == "pixtral":
        return PixtralFamily
    return families.get(config.model_type)
