"""Loading of a checkpoint's image processor: here it is chosen how frames are scaled.

Image processors are those of PIL unless the user says otherwise: torchvision's resize gives other
pixels, and results must not depend on which packages are installed. Their arithmetic is replaced by
one that gives the same bits in less time.
"""

from collections.abc import Collection
from functools import lru_cache
from pathlib import Path
from typing import Any, cast
from weakref import WeakKeyDictionary

import numpy as np
import transformers
from numba import njit
from numpy.typing import NDArray
from transformers.image_processing_backends import PilBackend

from infthor_eval.errors import ModelError
from infthor_eval.process_settings import tune_malloc
from model_adapters.hf.loading.resampling import FILTERS, Resize, find_resize
from model_adapters.options.checkpoints import FrameScaling

_SPLITTING = ("do_image_splitting", "crop_to_patches", "do_pan_and_scan")

_LEVELS = 256  # of a pixel
_LEAST = 32  # pixels along a side, below which Pillow itself takes no time
_MOST = 64  # sizes whose resize is found out; to do so takes longer than to resize once
_SEED = 0


def load_image_processor(
    folder: Path, options: Any = None, *, trust_remote_code: bool = False, **settings: Any
) -> Any:
    """Return the image processor of a checkpoint, with these settings in place of its own.

    It gives what transformers' own one gives, bit by bit.

    Args:
        folder: folder of the checkpoint.
        options: options of the model; those of `FrameScaling` are used if it has them.
        trust_remote_code: run code that comes with the checkpoint.
        settings: settings of the image processor.
    """
    tune_malloc()
    scaling = options if isinstance(options, FrameScaling) else FrameScaling()
    processor = cast(Any, transformers).AutoImageProcessor.from_pretrained(
        folder, backend=scaling.image_backend, trust_remote_code=trust_remote_code, **settings
    )
    if isinstance(processor, PilBackend):
        cast(Any, processor).__class__ = _quick(cast(Any, type(processor)))
    if scaling.image_splitting is not None:
        setattr(processor, splitting_setting(processor), scaling.image_splitting)
    return processor


def image_backend(image_processor: Any) -> str:
    """Return what resizes frames: pil or torchvision."""
    return str(getattr(image_processor, "backend", "pil"))


def splitting_setting(image_processor: Any) -> str:
    """Return the name of the setting that splits frames."""
    known = getattr(image_processor, "valid_kwargs", None)
    name = next(
        (name for name in _SPLITTING if name in getattr(known, "__annotations__", {})), None
    )
    if name is None:
        raise ModelError(
            f"{type(image_processor).__name__} cannot split frames; leave image_splitting out"
        )
    return name


@lru_cache
def _quick(processor_class: type) -> type:
    """Return the class with quick arithmetic; its own overrides of transformers' are kept."""
    # Saved settings have the name of the class.
    return type(processor_class.__name__, (_QuickResize, processor_class, _QuickRescale), {})


class _QuickResize:
    """What comes before an image processor's own methods: how it resizes is found out once for each
    size, on an image of noise, and done by `find_resize` from then on."""

    def resize(self, image: Any, *args: Any, **kwargs: Any) -> Any:
        """Resize an image, (channels, height, width), as the image processor does."""
        if not _is_frame(image):
            return self._resize_slowly(image, *args, **kwargs)
        known = _RESIZES.setdefault(self, {})
        key = f"{image.shape} {args} {kwargs}"
        if key not in known and len(known) < _MOST:
            noise = np.random.default_rng(_SEED).integers(0, _LEVELS, image.shape, np.uint8)
            resample = kwargs.get("resample")
            resized = self._resize_slowly(noise, *args, **kwargs)
            number = int(resample) if resample in FILTERS else None
            # Some return more than the image.
            is_image = isinstance(resized, np.ndarray)
            known[key] = find_resize(noise, resized, number) if is_image else None
        quick = known.get(key)
        return self._resize_slowly(image, *args, **kwargs) if quick is None else quick(image)

    def _resize_slowly(self, image: Any, *args: Any, **kwargs: Any) -> Any:
        return cast(Any, super()).resize(image, *args, **kwargs)


# Not among a processor's attributes, which are its settings.
_RESIZES: WeakKeyDictionary[_QuickResize, dict[str, Resize | None]] = WeakKeyDictionary()


def _is_frame(image: Any) -> bool:
    """Return whether this is an image of 8 bits that is worth the trouble."""
    return (
        isinstance(image, np.ndarray)
        and image.dtype == np.uint8
        and image.ndim == 3
        and min(image.shape[1:]) >= _LEAST
    )


class _Rescaled(np.ndarray):
    """An image that `rescale` made; no processor uses it but to normalise it, so that this is done
    in place, as memory for another one takes longer than the arithmetic.

    Attributes:
        is_whole: False for its views, which may overlap.
    """

    is_whole = False


class _QuickRescale(PilBackend):
    """What comes behind an image processor's own methods, in place of transformers' arithmetic."""

    def rescale(self, image: Any, scale: float, **kwargs: Any) -> Any:
        """Return the image times a factor, in float32, (channels, height, width)."""
        if not _is_frame(image):
            return super().rescale(image, scale, **kwargs)
        levels = np.arange(_LEVELS, dtype=np.uint8).reshape(1, 1, -1)
        rescaled = np.empty(image.shape, np.float32)
        _look_up(image, super().rescale(levels, scale, **kwargs).reshape(-1), rescaled)
        image = rescaled.view(_Rescaled)
        image.is_whole = True
        return image

    def normalize(self, image: Any, mean: Any, std: Any, **kwargs: Any) -> Any:
        """Return the image less the means, divided by the deviations, (channels, height, width);
        one that `rescale` made is overwritten."""
        if image.ndim != 3 or image.dtype != np.float32 or not _is_each(image, mean, std):
            return super().normalize(image, mean, std, **kwargs)
        in_place = isinstance(image, _Rescaled) and image.is_whole
        normalized = image if in_place else np.array(image, order="C")
        _shift_and_scale(normalized, np.array(mean, np.float32), np.array(std, np.float32))
        return normalized.view(np.ndarray)


def _is_each(image: NDArray[Any], *values: Any) -> bool:
    """Return whether each has one value for each channel of the image."""
    return all(isinstance(each, Collection) and len(each) == len(image) for each in values)


@njit("void(uint8[:, :, :], float32[::1], float32[:, :, ::1])", cache=True, nogil=True)
def _look_up(
    image: NDArray[np.uint8], table: NDArray[np.float32], values: NDArray[np.float32]
) -> None:
    for channel in range(image.shape[0]):
        for row in range(image.shape[1]):
            for column in range(image.shape[2]):
                values[channel, row, column] = table[image[channel, row, column]]


# The error model lets the division be of several numbers at once.
@njit(
    "void(float32[:, :, ::1], float32[::1], float32[::1])",
    cache=True,
    nogil=True,
    error_model="numpy",
)
def _shift_and_scale(
    image: NDArray[np.float32], mean: NDArray[np.float32], std: NDArray[np.float32]
) -> None:
    for channel in range(image.shape[0]):
        less, by = mean[channel], std[channel]
        for row in range(image.shape[1]):
            for column in range(image.shape[2]):
                image[channel, row, column] = (image[channel, row, column] - less) / by
