"""Loading a checkpoint's processor of images and text.

transformers loads a processor whole, with its parts for videos and sounds, which need torchvision
and librosa. Frames are given as images, so these are left out where that is not installed. Images
are scaled by PIL; a few families have no such processor. What theirs take from torchvision are a
few functions on tensors, which are torch's own under other names. So these stand in for it, and
pixels are the same as with it.
"""

import enum
import platform
import re
import sys
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import torch
import transformers
from PIL import Image
from transformers import image_processing_backends
from transformers.models.auto.image_processing_auto import IMAGE_PROCESSOR_MAPPING_NAMES
from transformers.models.auto.processing_auto import PROCESSOR_MAPPING
from transformers.utils import is_librosa_available, is_torchvision_available

from infthor_eval.errors import ModelError
from infthor_eval.formats.reading import read_json
from model_adapters.hf.loading.checkpoint import LocatedCheckpoint, wrap_loading_errors
from model_adapters.hf.loading.image_processors import load_image_processor, splitting_setting
from model_adapters.options.checkpoints import FrameScaling

# Parts that images do not need, and whether there is what they do.
_OTHER_PARTS = {
    "video_processor": is_torchvision_available,
    "feature_extractor": is_librosa_available,
}
# Files that may name the processor's class, in transformers' order.
_NAMING = ("processor_config.json", "preprocessor_config.json", "tokenizer_config.json")
_PACKAGE = re.compile(r"Package `(\w+)` is required|requires the (\w+) library")
_FUNCTIONS = "torchvision.transforms.v2.functional"


def load_processor(located: LocatedCheckpoint[Any]) -> Any:
    """Return the checkpoint's processor, for architectures without a family."""
    options = located.options
    pretrained = options.pretrained
    remote = {"trust_remote_code": options.trust_remote_code}
    with wrap_loading_errors(pretrained), torchvision_or_stand_in():
        try:
            register_image_processor(located.config)
            processor = _processor_class(located).from_pretrained(located.folder, **remote)
            processor.image_processor = load_image_processor(
                located.folder, options, **remote, **options.image_settings()
            )
        except ModelError:
            raise
        # Without torchvision, its classes are missing in many ways.
        except Exception as error:
            package = _missing_package(error)
            if package is None:
                raise
            raise ModelError(
                f"the processor of {pretrained} needs {package}: pip install {package}"
            ) from error
    if not hasattr(processor, "tokenizer"):
        raise ModelError(f"{pretrained} has no processor of images and text together")
    if isinstance(options, FrameScaling) and options.image_splitting is not None:
        _split(processor, splitting=options.image_splitting)
    return processor


def _split(processor: Any, *, splitting: bool) -> None:
    """Have a processor split frames or not, whatever it asks its image processor for by itself."""
    setting = splitting_setting(processor.image_processor)
    own = type(processor)

    def merge(self: Any, *args: Any, **kwargs: Any) -> Any:
        merged = own._merge_kwargs(self, *args, **kwargs)
        merged["images_kwargs"][setting] = splitting
        return merged

    processor.__class__ = type(own.__name__, (own,), {"_merge_kwargs": merge})


def _processor_class(located: LocatedCheckpoint[Any]) -> Any:
    """Return the class of the processor without what cannot be loaded of it; the class that finds
    it out where all can, and for code of the checkpoint's own."""
    name = _class_name(located.folder)
    named = None if name is None else getattr(transformers, name, None)
    processor_class: Any = available_class(
        named or PROCESSOR_MAPPING.get(type(located.config), None)
    )
    if processor_class is None or not hasattr(processor_class, "get_attributes"):
        return transformers.AutoProcessor
    missing = {name for name, is_there in _OTHER_PARTS.items() if not is_there()}
    if missing & {*processor_class.get_attributes()}:
        return _without(processor_class, missing)
    return transformers.AutoProcessor if is_torchvision_available() else processor_class


def _without(processor_class: Any, missing: Collection[str]) -> Any:
    """Return a processor's class that loads None for some of its parts."""
    attributes = processor_class.get_attributes()
    left = [attribute for attribute in attributes if attribute not in missing]
    # transformers loads what a class has by this; all else goes by the class itself.
    loaded: Any = type(
        processor_class.__name__,
        (processor_class,),
        {"get_attributes": classmethod(lambda _: left)},
    )

    class WithoutParts(processor_class):
        @classmethod
        def _get_arguments_from_pretrained(cls, *args: Any, **kwargs: Any) -> list[Any]:
            parts = loaded._get_arguments_from_pretrained(*args, **kwargs)
            by_name = dict(zip(left, parts, strict=True))
            return [by_name.get(attribute) for attribute in attributes]

        def check_argument_for_proper_class(self, argument_name: str, argument: Any) -> Any:
            if argument_name in missing and argument is None:
                return None
            return super().check_argument_for_proper_class(argument_name, argument)

    WithoutParts.__name__ = processor_class.__name__
    return WithoutParts


def _class_name(folder: Path) -> str | None:
    """Return the name of the processor's class in the files, if it is one of transformers."""
    for name in _NAMING:
        path = folder / name
        settings = read_json(path, "restore the checkpoint's files") if path.exists() else {}
        if "AutoProcessor" in settings.get("auto_map", {}):
            return None
        if "processor_class" in settings:
            return str(settings["processor_class"])
    return None


def _missing_package(error: Exception) -> str | None:
    """Return the package that a processor could not be loaded without, if that was the reason."""
    found = _PACKAGE.search(str(error))
    if found is not None:
        return next(filter(None, found.groups())).lower()
    return None if is_torchvision_available() else "torchvision"


class _InterpolationMode(enum.Enum):
    """Names that modules look for; those in `_FILTERS` are torch's for what `resize` can do."""

    BILINEAR = "bilinear"
    BICUBIC = "bicubic"
    LANCZOS = "lanczos"


class _Filters(dict[int, _InterpolationMode]):
    """Filters by PIL's numbers for them."""

    def __missing__(self, number: int) -> _InterpolationMode:
        raise NotImplementedError(f"resample={number} requires the torchvision library")


_FILTERS = _Filters(
    {
        Image.Resampling.BILINEAR: _InterpolationMode.BILINEAR,
        Image.Resampling.BICUBIC: _InterpolationMode.BICUBIC,
    }
)


def _pil_to_tensor(image: Image.Image) -> torch.Tensor:
    """Return an image's pixels, (channels, height, width)."""
    pixels = torch.from_numpy(np.array(image))
    return pixels.reshape(image.height, image.width, -1).permute(2, 0, 1)


def _resize(
    image: torch.Tensor,
    size: Sequence[int],
    interpolation: _InterpolationMode = _InterpolationMode.BILINEAR,
    antialias: bool = True,
) -> torch.Tensor:
    """Return images, (..., channels, height, width), in another size, (height, width)."""
    if tuple(size) == tuple(image.shape[-2:]):
        return image
    batch = image.reshape(-1, *image.shape[-3:])
    as_floats = batch.dtype == torch.uint8 and not _resizes_bytes(interpolation)
    resized = torch.nn.functional.interpolate(
        batch.float() if as_floats else batch,
        size=list(size),
        mode=interpolation.value,
        align_corners=False,
        antialias=antialias,
    )
    if as_floats:
        resized = resized.clamp(0, 255).round().to(torch.uint8)
    return resized.reshape(*image.shape[:-2], *size)


def _resizes_bytes(interpolation: _InterpolationMode) -> bool:
    """Return whether torchvision has torch resize bytes as they are, not as floats."""
    return (
        interpolation is _InterpolationMode.BICUBIC
        or torch.backends.cpu.get_cpu_capability() in ("AVX2", "AVX512")
        or platform.machine() in ("aarch64", "arm64")
    )


def _normalize(image: torch.Tensor, mean: Any, std: Any, inplace: bool = False) -> torch.Tensor:
    """Return images, (..., channels, height, width), less a mean and by a deviation of each
    channel."""
    less, by = (
        torch.as_tensor(value, dtype=image.dtype, device=image.device).reshape(-1, 1, 1)
        for value in (mean, std)
    )
    return (image.sub_(less) if inplace else image.sub(less)).div_(by)


def _pad(
    image: torch.Tensor,
    padding: Sequence[int],
    fill: float | Sequence[float] = 0,
    padding_mode: str = "constant",
) -> torch.Tensor:
    """Return images, (..., channels, height, width), with a margin (left, top, right, bottom)."""
    if padding_mode != "constant":
        raise NotImplementedError(f"padding_mode={padding_mode} requires the torchvision library")
    left, top, right, bottom = padding
    height, width = image.shape[-2:]
    fills = torch.as_tensor(fill, device=image.device).to(image.dtype).reshape(-1, 1, 1)
    padded = fills.expand(*image.shape[:-2], height + top + bottom, width + left + right).clone()
    padded[..., top : top + height, left : left + width] = image
    return padded


def _crop(image: torch.Tensor, top: int, left: int, height: int, width: int) -> torch.Tensor:
    """Return a part of images, (..., height, width), which lies inside of them."""
    return image[..., top : top + height, left : left + width]


def _functions() -> ModuleType:
    module = ModuleType(_FUNCTIONS)
    vars(module).update(
        InterpolationMode=_InterpolationMode,
        pil_to_tensor=_pil_to_tensor,
        resize=_resize,
        normalize=_normalize,
        pad=_pad,
        crop=_crop,
    )
    return module


@contextmanager
def torchvision_or_stand_in() -> Iterator[None]:
    """Have modules that are imported in this context find the functions above where torchvision is
    not installed."""
    # transformers keeps the answer, so that it does not take these functions for torchvision.
    if is_torchvision_available():
        yield
        return
    functions = _functions()
    backends: Any = image_processing_backends
    backends.tvF = functions
    backends.pil_torch_interpolation_mapping = _FILTERS
    sys.modules |= _packages(functions)
    try:
        yield
    finally:
        for name in _packages(functions):
            del sys.modules[name]


def _packages(functions: ModuleType) -> dict[str, ModuleType]:
    """Return a module and the packages that it is in, by name."""
    modules = {functions.__name__: functions}
    child = functions
    while "." in child.__name__:
        name, _, attribute = child.__name__.rpartition(".")
        package = ModuleType(name)
        package.__path__ = []
        setattr(package, attribute, child)
        modules[name] = child = package
    for name, module in modules.items():
        module.__spec__ = ModuleSpec(name, None)
    return modules


def available_class(found: Any) -> Any:
    """Return a class of transformers; where it has a dummy, because a package is missing, the class
    itself."""
    if getattr(found, "is_dummy", False):
        return getattr(import_module(found.__module__), found.__name__)
    return found


def register_image_processor(config: Any) -> None:
    """Have transformers find the image processor of a model that has none but torchvision's."""
    names = IMAGE_PROCESSOR_MAPPING_NAMES.get(config.model_type, {})
    if is_torchvision_available() or "pil" in names or "torchvision" not in names:
        return
    processor_class = available_class(getattr(transformers, names["torchvision"]))
    transformers.AutoImageProcessor.register(
        type(config), image_processor_classes={"torchvision": processor_class}, exist_ok=True
    )
