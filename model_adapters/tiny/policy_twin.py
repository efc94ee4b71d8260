"""Tiny twins of policies: published layout, random weights, read by the family's loader."""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import torch
from safetensors.torch import save_file
from tokenizers import Tokenizer

from infthor_eval.storage.scratch import ScratchFolder
from model_adapters.options.policies import PolicyOptions
from model_adapters.policies.checkpoint import PolicyCheckpoint
from model_adapters.policies.policy import VlaPolicy
from model_adapters.policies.weights import Layout, Shape

# Statistics of the actions of Bridge in openvla/openvla-7b and SpatialVLA's checkpoints, to four
# digits.
BRIDGE = {
    "action": {
        "q01": [-0.0287, -0.0417, -0.0261, -0.0809, -0.0929, -0.2072, 0.0],
        "q99": [0.0283, 0.0409, 0.0402, 0.0819, 0.0779, 0.2038, 1.0],
        "mask": [True] * 6 + [False],
    }
}

_GAIN = 1.5  # above 1, so that outputs depend on inputs


@dataclass(frozen=True, kw_only=True)
class PolicyTwin:
    """Description of a tiny policy of a family.

    Attributes:
        files: JSON files beside the weights, by name.
        tokenizer: builds the tokenizer.
        layout: builds the layout of the weights.
        load: loader of the family.
    """

    files: Mapping[str, Mapping[str, Any]]
    tokenizer: Callable[[], Tokenizer]
    layout: Callable[[], Layout]
    load: Callable[[str, PolicyCheckpoint, Any], VlaPolicy]

    def save(self, folder: Path, seed: int) -> None:
        """Write a checkpoint with weights of this seed, which the family's adapter loads; the
        folder is created."""
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in self.files.items():
            (folder / name).write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
        self.tokenizer().save(str(folder / "tokenizer.json"))
        save_file(_draw_weights(self.layout().all_shapes(), seed), folder / "model.safetensors")


class TinyPolicyAdapter:
    """Base of the adapters of tiny policies."""

    Options: ClassVar[type]
    twin: ClassVar[PolicyTwin]

    @classmethod
    def build(cls, name: str, options: PolicyOptions, seed: int) -> VlaPolicy:
        """Build a policy with random weights of this seed, loaded from a temporary checkpoint."""
        with ScratchFolder() as folder:
            cls.twin.save(folder, seed)
            return cls.twin.load(
                name, PolicyCheckpoint(folder, name, {"checkpoint": name, "seed": seed}), options
            )


def _draw_weights(shapes: Mapping[str, Shape], seed: int) -> dict[str, torch.Tensor]:
    """Return random weights in float32, drawn in the order of their names."""
    generator = torch.Generator().manual_seed(seed)
    return {key: _draw_weight(key, shapes[key], generator) for key in sorted(shapes)}


def _draw_weight(key: str, shape: Shape, generator: torch.Generator) -> torch.Tensor:
    noise = torch.randn(shape, generator=generator)
    if len(shape) > 1:
        return noise * _GAIN / math.sqrt(math.prod(shape[1:]))
    return noise * 0.1 if key.endswith("bias") else 1 + noise * 0.1  # norms and layer scales
