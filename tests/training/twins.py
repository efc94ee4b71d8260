"""Tiny models of every family and sequences for them, the same in every process."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import torch
from PIL import Image
from safetensors.torch import load_file

from infthor_eval.formats.frames import FrameRef
from infthor_eval.training.encoding import Encoder, TrainingSequence
from infthor_eval.training.network import SequenceModel
from model_adapters import load
from model_adapters.hf.loading.loaded import LoadedCheckpoint

FAMILIES = ("qwen2.5-vl", "llava-onevision", "deepseek-vl", "pixtral")
PAD = 0


def loaded(family: str) -> LoadedCheckpoint:
    """A tiny model of a family with the weights of seed 0."""
    model: Any = load(f"{family}-tiny", {}, seed=0)
    checkpoint: LoadedCheckpoint = model._loaded
    return checkpoint


def write_frames(folder: Path, count: int) -> list[FrameRef]:
    """Frames of coloured noise, all different; 9 tokens each in Qwen2.5-VL."""
    folder.mkdir(parents=True, exist_ok=True)
    draw = np.random.default_rng(0)
    refs = []
    for index in range(count):
        path = folder / f"{index}.png"
        noise = draw.integers(0, 256, (4, 4, 3), dtype=np.uint8)
        Image.fromarray(noise).resize((84, 84)).save(path)
        refs.append(FrameRef(path))
    return refs


def sequence(
    model: LoadedCheckpoint, frames: Sequence[FrameRef], answer: str = "a mug", name: str = "one"
) -> TrainingSequence:
    """Frames with a text behind each, a question, and the answer, on which loss is taken."""
    parts = [
        part for number, frame in enumerate(frames) for part in (frame, f"\nRotateLeft {number}\n")
    ]
    return Encoder(model).answer(name, ["What happens?\n", *parts, "What do you see now?"], answer)


def everywhere(encoded: TrainingSequence) -> TrainingSequence:
    """The same sequence with loss on every token of text."""
    return replace(encoded, has_loss=tuple(isinstance(piece, int) for piece in encoded.pieces))


def trained_texts(encoder: Encoder, encoded: TrainingSequence) -> list[str]:
    """The texts that loss is taken on, each without a break, by the tokenizer alone."""
    runs = groupby(zip(encoded.pieces, encoded.has_loss, strict=True), key=lambda pair: pair[1])
    return [
        encoder._tokenizer.decode([piece for piece, _ in run]) for has_loss, run in runs if has_loss
    ]


def gradients_of(model: SequenceModel) -> dict[str, torch.Tensor]:
    """The gradients that there are."""
    named = model.named_parameters()
    return {name: one.grad.clone() for name, one in named if one.grad is not None}


def read_weights(out: Path) -> dict[str, torch.Tensor]:
    """The weights that a training has written."""
    return load_file(out / "checkpoint" / "model.safetensors")
