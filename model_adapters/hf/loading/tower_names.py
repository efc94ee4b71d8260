"""Names of the weights of vision towers in checkpoints of LLaVA and its kin.

Published checkpoints have a level `vision_model` in a CLIP or SigLIP tower
(`vision_tower.vision_model.encoder...`). From 5.17 on, transformers saves it without that level,
reads both, and vLLM 0.32 reads the published form alone.
"""

import re
from collections.abc import Mapping
from typing import TypeVar

# Parts of CLIP's and SigLIP's towers; Pixtral's has others and no such level.
_FLAT = re.compile(
    r"^((?:model\.)?vision_tower\.)(?=(?:embeddings|encoder|pre_layrnorm|post_layernorm|head)\.)"
)

T = TypeVar("T")


def published_name(name: str) -> str:
    """Return the name of a weight as published checkpoints have it."""
    return _FLAT.sub(r"\1vision_model.", name)


def with_published_names(weights: Mapping[str, T]) -> dict[str, T]:
    """Return weights by the names that published checkpoints have."""
    return {published_name(name): weight for name, weight in weights.items()}
