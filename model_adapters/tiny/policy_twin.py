"""How a tiny twin of a policy is made: a whole checkpoint in the published layout, read by the family's own loader."""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from safetensors.torch import save_file
from tokenizers import Tokenizer

from infthor_eval.formats.scratch import ScratchFolder
from model_adapters.options.policies import PolicyOptions
from model_adapters.policies.checkpoint import PolicyCheckpoint
from model_adapters.policies.policy import VlaPolicy
from model_adapters.policies.weights import Layout, Shape

__all__ = ["BRIDGE", "PolicyTwin"]

# What openvla/openvla-7b and SpatialVLA's checkpoints say of the actions of Bridge, to four digits.
BRIDGE = {
    "action": {
        "q01": [-0.0287, -0.0417, -0.0261, -0.0809, -0.0929, -0.2072, 0.0],
        "q99": [0.0283, 0.0409, 0.0402, 0.0819, 0.0779, 0.2038, 1.0],
        "mask": [True] * 6 + [False],
    }
}

_GAIN = 1.5  # above 1, so that what goes in makes a difference in what comes out


@dataclass(frozen=True, kw_only=True)
class PolicyTwin:
    """What makes a tiny policy one of its family.

    Attributes:
        files: JSON files beside the weights, by name.
        tokenizer: makes the tokenizer.
        layout: makes the layout of its weights.
        load: the family's loader.
    """

    files: Callable[[], Mapping[str, Mapping[str, Any]]]
    tokenizer: Callable[[], Tokenizer]
    layout: Callable[[], Layout]
    load: Callable[[str, PolicyCheckpoint, Any], VlaPolicy]

    def save(self, folder: Path, seed: int) -> None:
        """Write a checkpoint that the family's adapter loads.

        Args:
            folder: made if it does not exist.
            seed: of the weights.
        """
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in self.files().items():
            (folder / name).write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
        self.tokenizer().save(str(folder / "tokenizer.json"))
        save_file(_random(self.layout().expected(), seed), folder / "model.safetensors")

    def build(self, name: str, options: PolicyOptions, seed: int) -> VlaPolicy:
        """The policy with random weights of this seed, by way of a checkpoint that is gone afterwards."""
        with ScratchFolder() as folder:
            self.save(folder, seed)
            return self.load(name, PolicyCheckpoint(folder, name, {"checkpoint": name, "seed": seed}), options)


def _random(shapes: Mapping[str, Shape], seed: int) -> dict[str, torch.Tensor]:
    """Weights in float32, drawn key by key in the order of their names."""
    draws = torch.Generator().manual_seed(seed)
    return {key: _drawn(key, shapes[key], draws) for key in sorted(shapes)}


def _drawn(key: str, shape: Shape, draws: torch.Generator) -> torch.Tensor:
    noise = torch.randn(shape, generator=draws)
    if len(shape) > 1:
        return noise * _GAIN / math.sqrt(math.prod(shape[1:]))
    return noise * 0.1 if key.endswith("bias") else 1 + noise * 0.1  # the latter of norms and layer scales
