"""Loading a checkpoint's processor of images and text.

transformers loads a processor whole, with its part for videos, which needs torchvision. Frames are
given as images, so that part is left out where torchvision is not installed.
"""

import re
from functools import partialmethod
from inspect import Parameter, signature
from pathlib import Path
from typing import Any

import transformers
from transformers.models.auto.processing_auto import PROCESSOR_MAPPING
from transformers.utils import is_torchvision_available

from infthor_eval.errors import ModelError
from infthor_eval.formats.reading import read_json
from model_adapters.hf.loading.checkpoint import LocatedCheckpoint, wrap_loading_errors
from model_adapters.hf.loading.image_processors import load_image_processor, splitting_setting
from model_adapters.options.checkpoints import FrameScaling

__all__ = ["load_processor"]

_VIDEO = "video_processor"
# Files that may name the processor's class, in transformers' order.
_NAMING = ("processor_config.json", "preprocessor_config.json", "tokenizer_config.json")
_PACKAGE = re.compile(r"Package `(\w+)` is required|requires the (\w+) library")


def load_processor(located: LocatedCheckpoint[Any]) -> Any:
    """Return the checkpoint's processor, for architectures without a family.

    Raises:
        ModelError: the checkpoint has none, it cannot be loaded, or it needs a package that is not
            installed.
    """
    options = located.options
    pretrained = options.pretrained
    remote = {"trust_remote_code": options.trust_remote_code}
    with wrap_loading_errors(pretrained):
        try:
            processor = _processor_class(located).from_pretrained(located.folder, **remote)
            processor.image_processor = load_image_processor(located.folder, options, **remote)
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
    """Return the class of the processor without its video part; the class that finds it out where
    torchvision is installed, and for code of the checkpoint's own."""
    name = _class_name(located.folder)
    named = None if name is None else getattr(transformers, name, None)
    processor_class: Any = named or PROCESSOR_MAPPING.get(type(located.config), None)
    if (
        is_torchvision_available()
        or processor_class is None
        or not hasattr(processor_class, "get_attributes")
    ):
        return transformers.AutoProcessor
    attributes = processor_class.get_attributes()
    if _VIDEO not in attributes:
        return processor_class
    # transformers loads what a class has by this, and checks its arguments by it.
    left = [attribute for attribute in attributes if attribute != _VIDEO]
    changes: dict[str, Any] = {"get_attributes": classmethod(lambda _: left), _VIDEO: None}
    if signature(processor_class.__init__).parameters[_VIDEO].default is Parameter.empty:
        changes["__init__"] = partialmethod(processor_class.__init__, **{_VIDEO: None})
    return type(processor_class.__name__, (processor_class,), changes)


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
