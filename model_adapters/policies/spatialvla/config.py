"""What a SpatialVLA checkpoint's config says, as far as it is needed."""

from typing import Any

import msgspec
from transformers import Gemma2Config, SiglipVisionConfig, ZoeDepthConfig

from infthor_eval.errors import ModelError

__all__ = ["SpatialVLAConfig"]


class SpatialVLAConfig(msgspec.Struct, frozen=True, kw_only=True):
    """`config.json`.

    Attributes:
        text_config: of Gemma 2.
        vision_config: of SigLIP.
        vision_zoe_config: of ZoeDepth.
        image_token_index: the id that the image's patches replace.
        action_token_begin_idx: the id of the first action token.
        spatial_token_num: how many action tokens there are.
        ego3d_patch_reso: points along each side of a patch.
        n_freqs: frequencies of each coordinate of a point.
        projection_dim: of the patches as Gemma sees them.
        use_spatial_token: whether action tokens have embeddings of their own.
        use_vision_zoe: whether patches know where they lie.
    """

    text_config: dict[str, Any]
    vision_config: dict[str, Any]
    vision_zoe_config: dict[str, Any]
    image_token_index: int
    action_token_begin_idx: int
    spatial_token_num: int
    ego3d_patch_reso: int
    n_freqs: int
    projection_dim: int
    use_spatial_token: bool = True
    use_vision_zoe: bool = True

    def check(self, pretrained: str) -> None:
        """Refuse a variant that is not run here.

        Raises:
            ModelError: it has no depth or no action tokens of its own, or these are not the last of the vocabulary.
        """
        at_end = self.action_token_begin_idx + self.spatial_token_num == self.text().vocab_size
        if not (self.use_spatial_token and self.use_vision_zoe and at_end):
            raise ModelError(
                f"{pretrained}: only SpatialVLA with use_spatial_token, use_vision_zoe and its action tokens at the "
                "end of the vocabulary can be run here"
            )

    def sides(self, pretrained: str) -> tuple[int, int, int]:
        """Sides, in pixels, of the image, of its patches, and of the image that depth is estimated on.

        Raises:
            ModelError: one of them is no square.
        """
        vision, backbone = self.vision(), self.zoe().backbone_config
        found = vision.image_size, vision.patch_size, getattr(backbone, "image_size", None)
        image, patch, zoe = found
        if not (isinstance(image, int) and isinstance(patch, int) and isinstance(zoe, int)):
            raise ModelError(f"{pretrained}: images, patches and depth images of sides {found} cannot be run here")
        return image, patch, zoe

    def text(self) -> Gemma2Config:
        """Gemma 2's config."""
        return Gemma2Config(**self.text_config)

    def vision(self) -> SiglipVisionConfig:
        """SigLIP's config."""
        return SiglipVisionConfig(**self.vision_config)

    def zoe(self) -> ZoeDepthConfig:
        """ZoeDepth's config."""
        return ZoeDepthConfig(**self.vision_zoe_config)
