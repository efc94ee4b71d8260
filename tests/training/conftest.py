"""A tiny model that knows the marks, and a set that was replayed."""

from pathlib import Path

import pytest

from infthor_eval.training.encoding import Encoder
from infthor_eval.training.starting_model import load_starting_model
from model_adapters.hf.loading.loaded import LoadedCheckpoint

from ..helpers.bundled import BUNDLED


@pytest.fixture(scope="session")
def bundled_set() -> Path:
    return BUNDLED


@pytest.fixture(scope="session")
def plain_tiny() -> LoadedCheckpoint:
    return load_starting_model("qwen2.5-vl-tiny", {}, "plain", seed=0)


@pytest.fixture(scope="session")
def encoder(plain_tiny: LoadedCheckpoint) -> Encoder:
    return Encoder(plain_tiny)
