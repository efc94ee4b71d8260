"""OpenVLA's network: patches of two towers after the begin token of a Llama-2."""

from dataclasses import dataclass

import torch
from PIL import Image
from tokenizers import Tokenizer
from torch import nn
from torch.nn.functional import gelu
from transformers import DynamicCache, LlamaConfig, LlamaForCausalLM

from model_adapters.hf.cached.kv_cache import cache_arguments
from model_adapters.policies.decoding import decode_greedily, embed_ids
from model_adapters.policies.openvla.actions import ActionBins
from model_adapters.policies.openvla.vision import Tower, TowerShape, unused_keys
from model_adapters.policies.preprocessing import normalise, resize
from model_adapters.policies.statistics import ACTION_SIZE, Actions
from model_adapters.policies.weights import Layout

_DINOV2 = ((0.484375, 0.455078125, 0.40625), (0.228515625, 0.2236328125, 0.224609375))
_SIGLIP = ((0.5, 0.5, 0.5), (0.5, 0.5, 0.5))
_SPACE = 29871  # Llama's token of a single space, which precedes every action in the training data


def prompt(instruction: str) -> str:
    """Return OpenVLA's prompt; instructions were in lower case in training."""
    return f"In: What action should the robot take to {instruction.lower()}?\nOut:"


def prompt_ids(tokenizer: Tokenizer, instruction: str) -> list[int]:
    """Return the prompt's ids, from the begin token to the space that precedes actions."""
    ids: list[int] = tokenizer.encode(prompt(instruction)).ids
    return ids if ids[-1] == _SPACE else [*ids, _SPACE]


class _Vision(nn.Module):
    def __init__(self, towers: tuple[TowerShape, TowerShape], image_size: int) -> None:
        super().__init__()
        self.featurizer = Tower(towers[0], image_size)
        self.fused_featurizer = Tower(towers[1], image_size)

    def forward(self, pixels: torch.Tensor) -> torch.Tensor:
        """Return features, (batch, patches, widths), of pixels from 0 to 1, (batch, 3, size, size),
        in float32."""
        dtype = self.featurizer.pos_embed.dtype
        features = (
            self.featurizer(normalise(pixels, *_DINOV2).to(dtype)),
            self.fused_featurizer(normalise(pixels, *_SIGLIP).to(dtype)),
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
    """All modules with weights, by the published checkpoint's names; the image size in pixels."""

    def __init__(
        self, towers: tuple[TowerShape, TowerShape], image_size: int, language: LlamaConfig
    ) -> None:
        super().__init__()
        self.vision_backbone = _Vision(towers, image_size)
        self.projector = _OpenVLAProjector(
            sum(tower.width for tower in towers), language.hidden_size
        )
        self.language_model = LlamaForCausalLM(language)


def weights_layout(weights: OpenVLAWeights, towers: tuple[TowerShape, TowerShape]) -> Layout:
    """Return the layout of the checkpoint, of modules without memory; the key of every parameter is
    its name."""
    parts = zip(("featurizer", "fused_featurizer"), towers, strict=True)
    unused = {
        f"vision_backbone.{part}.{key}": shape
        for part, tower in parts
        for key, shape in unused_keys(tower).items()
    }
    return Layout.of(weights, lambda name: name, unused)


@dataclass(frozen=True)
class OpenVLANetwork:
    """A loaded OpenVLA.

    Attributes:
        weights: all modules, on their device.
        tokenizer: tokenizer of the language model, which adds the begin token.
        bins: conversion of action ids.
        image_size: image size of both towers, in pixels.
    """

    weights: OpenVLAWeights
    tokenizer: Tokenizer
    bins: ActionBins
    image_size: int

    @torch.inference_mode()
    def predict(self, image: Image.Image, instruction: str, *, constrained: bool) -> Actions:
        """Return a chunk of one action; see `Network.predict`."""
        model = self.weights.language_model
        cache = DynamicCache(config=model.config)

        def logits(embeds: torch.Tensor) -> torch.Tensor:
            output = model(inputs_embeds=embeds, **cache_arguments(model, cache), logits_to_keep=1)
            return output.logits[0, -1].float()

        def step(token: int) -> torch.Tensor:
            return logits(embed_ids(model, [token]))

        pixels = resize(image, self.image_size).to(model.device)[None]
        patches = self.weights.projector(self.weights.vision_backbone(pixels))
        text = embed_ids(model, prompt_ids(self.tokenizer, instruction))
        first = logits(torch.cat([text[:, :1], patches, text[:, 1:]], dim=1))
        ids = decode_greedily(
            first, step, [self.bins.action_ids] * ACTION_SIZE, constrained=constrained
        )
        return self.bins.decode(ids)
