"""Frames and tiny models for the tests of adapters."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from PIL import Image

from infthor_eval.formats.frames import FrameRef
from model_adapters import load


@pytest.fixture(scope="session")
def make_frames(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., list[FrameRef]]:
    """Writes frames of coloured noise, all different, and returns references to them."""

    def make(count: int, width: int = 84, height: int = 84, seed: int = 0) -> list[FrameRef]:
        folder = tmp_path_factory.mktemp("frames")
        draw = np.random.default_rng(seed)
        refs = []
        for index in range(count):
            coarse = draw.integers(0, 256, (4, 4, 3), dtype=np.uint8)
            path = folder / f"{index:09d}.png"
            Image.fromarray(coarse).resize((width, height)).save(path)
            refs.append(FrameRef(path))
        return refs

    return make


@pytest.fixture(scope="session")
def frames(make_frames: Callable[..., list[FrameRef]]) -> list[FrameRef]:
    """Six small frames (9 tokens each in Qwen2.5-VL)."""
    return make_frames(6)


@pytest.fixture(scope="session")
def tiny() -> Iterator[Any]:
    """A tiny Qwen2.5-VL that shares prefixes, with chunks small enough to need several."""
    model = load("qwen2.5-vl-tiny", {"chunk_tokens": "24"}, seed=0)
    yield model
    model.close()  # type: ignore[union-attr]


@pytest.fixture(scope="session")
def plain() -> Iterator[Any]:
    """The same model without sharing, encoding everything in one forward pass."""
    model = load("qwen2.5-vl-tiny", {"share_prefix": "false", "chunk_tokens": "1000000"}, seed=0)
    yield model
    model.close()  # type: ignore[union-attr]
