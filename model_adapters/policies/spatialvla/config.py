"""The config of a SpatialVLA checkpoint, as far as it is used."""

from typing import Any

import msgspec
from transformers import Gemma2Config, SiglipVisionConfig, ZoeDepthConfig

from infthor_eval.errors import ModelError


class SpatialVLAConfig(msgspec.Struct, frozen=True, kw_only=True):
    """`config.json`.

    Attributes:
        text_config: config of Gemma 2.
        vision_config: config of SigLIP.
        vision_zoe_config: config of ZoeDepth.
        image_token_index: id of the image tokens, which patches replace.
        action_token_begin_idx: id of the first action token.
        spatial_token_num: number of action tokens.
        ego3d_patch_reso: points along each side of a patch.
        n_freqs: frequencies of each coordinate of a point.
        projection_dim: width of the patches as input of Gemma.
        use_spatial_token: true if action tokens have separate embeddings.
        use_vision_zoe: true if patches have 3D positions.
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
        """Check that this variant is supported."""
        at_end = self.action_token_begin_idx + self.spatial_token_num == self.text().vocab_size
        if not (self.use_spatial_token and self.use_vision_zoe and at_end):
            raise ModelError(
                f"{pretrained}: only SpatialVLA with use_spatial_token, use_vision_zoe and its "
                "action tokens at the end of the vocabulary is supported"
            )

    def sides(self, pretrained: str) -> tuple[int, int, int]:
        """Return the sides, in pixels, of the image, its patches, and the image for depth."""
        vision = self.vision()
        backbone = self.zoe().backbone_config
        sides = vision.image_size, vision.patch_size, getattr(backbone, "image_size", None)
        image, patch, zoe = sides
        if not (isinstance(image, int) and isinstance(patch, int) and isinstance(zoe, int)):
            raise ModelError(
                f"{pretrained}: images, patches and depth images of sides {sides} are not supported"
            )
        return image, patch, zoe

    def text(self) -> Gemma2Config:
        """Return the config of Gemma 2."""
        return Gemma2Config(**self.text_config)

    def vision(self) -> SiglipVisionConfig:
        """Return the config of SigLIP."""
        return SiglipVisionConfig(**self.vision_config)

    def zoe(self) -> ZoeDepthConfig:
        """Return the config of ZoeDepth."""
        return ZoeDepthConfig(**self.vision_zoe_config)
