"""Loading a checkpoint's processor of images and text.

transformers loads a processor whole, with its part for videos, which needs torchvision. Frames are
given as images, so that part is left out where torchvision is not installed. Images are scaled by
PIL; a few families have no such processor, and torchvision's part in theirs is torch's own
(`without_torchvision`).
"""

import re
from pathlib import Path
from typing import Any

import transformers
from transformers.models.auto.processing_auto import PROCESSOR_MAPPING
from transformers.utils import is_torchvision_available

from infthor_eval.errors import ModelError
from infthor_eval.formats.reading import read_json
from model_adapters.hf.loading.checkpoint import LocatedCheckpoint, wrap_loading_errors
from model_adapters.hf.loading.image_processors import load_image_processor, splitting_setting
from model_adapters.hf.loading.without_torchvision import (
    available_class,
    register_image_processor,
    torchvision_or_stand_in,
)
from model_adapters.options.checkpoints import FrameScaling

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
    """Return the class of the processor without its video part; the class that finds it out where
    torchvision is installed, and for code of the checkpoint's own."""
    name = _class_name(located.folder)
    named = None if name is None else getattr(transformers, name, None)
    processor_class: Any = available_class(
        named or PROCESSOR_MAPPING.get(type(located.config), None)
    )
    if (
        is_torchvision_available()
        or processor_class is None
        or not hasattr(processor_class, "get_attributes")
    ):
        return transformers.AutoProcessor
    has_video = _VIDEO in processor_class.get_attributes()
    return _without_video(processor_class) if has_video else processor_class


def _without_video(processor_class: Any) -> Any:
    """Return a processor's class that loads None for the part for videos."""
    attributes = processor_class.get_attributes()
    left = [attribute for attribute in attributes if attribute != _VIDEO]
    # transformers loads what a class has by this; all else goes by the class itself.
    loaded: Any = type(
        processor_class.__name__,
        (processor_class,),
        {"get_attributes": classmethod(lambda _: left)},
    )

    class WithoutVideo(processor_class):
        @classmethod
        def _get_arguments_from_pretrained(cls, *args: Any, **kwargs: Any) -> list[Any]:
            parts = loaded._get_arguments_from_pretrained(*args, **kwargs)
            by_name = dict(zip(left, parts, strict=True))
            return [by_name.get(attribute) for attribute in attributes]

        def check_argument_for_proper_class(self, argument_name: str, argument: Any) -> Any:
            if argument_name == _VIDEO and argument is None:
                return None
            return super().check_argument_for_proper_class(argument_name, argument)

    WithoutVideo.__name__ = processor_class.__name__
    return WithoutVideo


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
