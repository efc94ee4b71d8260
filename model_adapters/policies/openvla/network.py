"""OpenVLA's network: patches of two towers behind the begin token of a Llama-2."""

from dataclasses import dataclass

import torch
from PIL import Image
from tokenizers import Tokenizer
from torch import nn
from torch.nn.functional import gelu
from transformers import DynamicCache, LlamaConfig, LlamaForCausalLM

from model_adapters.policies.decoding import embedded, greedy
from model_adapters.policies.openvla.actions import ActionBins
from model_adapters.policies.openvla.vision import Tower, TowerShape, unused_keys
from model_adapters.policies.preprocessing import normalised, resized
from model_adapters.policies.statistics import ACTION_SIZE, Actions
from model_adapters.policies.weights import Layout

__all__ = ["OpenVLANetwork", "OpenVLAWeights", "layout_of", "prompt", "prompt_ids"]

_DINOV2 = ((0.484375, 0.455078125, 0.40625), (0.228515625, 0.2236328125, 0.224609375))
_SIGLIP = ((0.5, 0.5, 0.5), (0.5, 0.5, 0.5))
_SPACE = 29871  # Llama's token of a lone space, which stood before every action in training


def prompt(instruction: str) -> str:
    """What OpenVLA is asked; instructions were in lower case in training."""
    return f"In: What action should the robot take to {instruction.lower()}?\nOut:"


def prompt_ids(tokenizer: Tokenizer, instruction: str) -> list[int]:
    """The ids of the prompt, with the space that actions follow.

    Args:
        tokenizer: of the language model; it writes the begin token by itself.
        instruction: what is to be done.
    """
    ids: list[int] = tokenizer.encode(prompt(instruction)).ids
    return ids if ids[-1] == _SPACE else [*ids, _SPACE]


class _Vision(nn.Module):
    def __init__(self, towers: tuple[TowerShape, TowerShape], image_size: int) -> None:
        super().__init__()
        self.featurizer = Tower(towers[0], image_size)
        self.fused_featurizer = Tower(towers[1], image_size)

    def forward(self, pixels: torch.Tensor) -> torch.Tensor:
        """Features, (batch, patches, width of both), of pixels between 0 and 1, (batch, 3, size, size), in float32."""
        dtype = self.featurizer.pos_embed.dtype
        features = (
            self.featurizer(normalised(pixels, *_DINOV2).to(dtype)),
            self.fused_featurizer(normalised(pixels, *_SIGLIP).to(dtype)),
        )
        return torch.cat(features, dim=2)


class _OpenVLAProjector(nn.Module):
    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.fc1 = nn.Linear(inputs, 4 * inputs)
        self.fc2 = nn.Linear(4 * inputs, outputs)
        self.fc3 = nn.Linear(outputs, outputs)

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        return self.fc3(gelu(self.fc2(gelu(self.fc1(features)))))


class OpenVLAWeights(nn.Module):
    """All that has weights, under the names of the published checkpoint.

    Args:
        towers: sizes of DINOv2 and SigLIP.
        image_size: of both, in pixels.
        language: config of the language model.
    """

    def __init__(self, towers: tuple[TowerShape, TowerShape], image_size: int, language: LlamaConfig) -> None:
        super().__init__()
        self.vision_backbone = _Vision(towers, image_size)
        self.projector = _OpenVLAProjector(sum(tower.width for tower in towers), language.hidden_size)
        self.language_model = LlamaForCausalLM(language)


def layout_of(weights: OpenVLAWeights, towers: tuple[TowerShape, TowerShape]) -> Layout:
    """The layout of the checkpoint of these weights: every parameter is a key of its own name.

    Args:
        weights: made within `empty()`.
        towers: sizes of DINOv2 and SigLIP.
    """
    parts = zip(("featurizer", "fused_featurizer"), towers, strict=True)
    unused = {
        f"vision_backbone.{part}.{key}": shape for part, tower in parts for key, shape in unused_keys(tower).items()
    }
    return Layout.of(weights, lambda name: name, unused)


@dataclass(frozen=True)
class OpenVLANetwork:
    """A loaded OpenVLA.

    Attributes:
        weights: on their device.
        tokenizer: of the language model; it writes the begin token by itself.
        bins: what action ids mean.
        image_size: of both towers, in pixels.
    """

    weights: OpenVLAWeights
    tokenizer: Tokenizer
    bins: ActionBins
    image_size: int

    @torch.inference_mode()
    def predict(self, image: Image.Image, instruction: str, *, constrained: bool) -> Actions:
        """A chunk of one action; see `Network.predict`."""
        model = self.weights.language_model
        cache = DynamicCache(config=model.config)

        def logits(fed: torch.Tensor) -> torch.Tensor:
            output = model(inputs_embeds=fed, past_key_values=cache, use_cache=True, logits_to_keep=1)
            return output.logits[0, -1].float()

        def step(token: int) -> torch.Tensor:
            return logits(embedded(model, [token]))

        pixels = resized(image, self.image_size).to(model.device)[None]
        patches = self.weights.projector(self.weights.vision_backbone(pixels))
        text = embedded(model, prompt_ids(self.tokenizer, instruction))
        first = logits(torch.cat([text[:, :1], patches, text[:, 1:]], dim=1))
        ids = greedy(first, step, [self.bins.legal] * ACTION_SIZE, constrained=constrained)
        return self.bins.decode(ids)
