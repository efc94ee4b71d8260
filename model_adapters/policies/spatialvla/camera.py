"""Camera intrinsics that SpatialVLA assumes for its frames."""

import math
from collections.abc import Mapping

import torch

from infthor_eval.errors import ModelError
from model_adapters.options.policies import DEFAULT_INTRINSICS
from model_adapters.policies.spatialvla.actions import CameraIntrinsics


def published_intrinsics(
    cameras: Mapping[str, CameraIntrinsics], unnorm_key: str, image_size: int, pretrained: str
) -> torch.Tensor:
    """Return the intrinsics, (3, 3), in pixels of the squashed image, of the dataset's camera or
    the default one.

    Args:
        cameras: cameras of the checkpoint by dataset.
        unnorm_key: key of the dataset.
        image_size: width and height that frames are squashed to.
        pretrained: name of the checkpoint, for the message.
    """
    camera = cameras.get(unnorm_key) or cameras.get(DEFAULT_INTRINSICS)
    rows = [] if camera is None else camera.intrinsic
    if (
        camera is None
        or [len(row) for row in rows] != [3, 3, 3]
        or min(camera.width, camera.height) < 1
    ):
        raise ModelError(
            f"{pretrained} has no intrinsics for {unnorm_key} and no default; give "
            "intrinsics=thor:DEGREES"
        )
    scale = torch.tensor([image_size / camera.width, image_size / camera.height, 1.0])
    return torch.tensor(rows) * scale[:, None]


def thor_intrinsics(degrees: float, size: tuple[int, int], image_size: int) -> torch.Tensor:
    """Return the intrinsics, (3, 3), in pixels of the squashed image, of a simulator's camera.

    Args:
        degrees: vertical field of view of the camera.
        size: width and height of its frames in pixels.
        image_size: width and height that frames are squashed to.
    """
    width, height = size
    focal = (height / 2) / math.tan(math.radians(degrees) / 2)
    middle = image_size / 2
    return torch.tensor(
        [
            [focal * image_size / width, 0, middle],
            [0, focal * image_size / height, middle],
            [0, 0, 1],
        ]
    )
