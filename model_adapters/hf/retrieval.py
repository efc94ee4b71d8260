"""Similarity of frames and texts by a CLIP model, for retrieval contexts.

A set has hundreds of thousands of frames, and every question on a trajectory ranks the same ones.
So each frame is embedded once, in small batches, and the vectors are kept in a file of the user's
cache: memory does not grow with the set, and the next run reuses them.
"""

import json
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import torch
import transformers

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.formats.frames import FrameRef
from infthor_eval.storage.digests import digest
from infthor_eval.storage.folders import user_cache
from model_adapters.hf.loading.checkpoint import (
    origin,
    resolve_device,
    versions,
    wrap_loading_errors,
)
from model_adapters.hf.loading.hub import fetch
from model_adapters.hf.loading.image_processors import load_image_processor
from model_adapters.hf.vectors import VectorFile
from model_adapters.options.checkpoints import Placement

_BATCH = 32  # frames whose pixels are in memory at once


class Retriever:
    """A CLIP model in float32, on a GPU if there is one; its vectors have length 1, so dot products
    are cosines."""

    def __init__(self, name: str, revision: str | None = None) -> None:
        """Load a checkpoint from a folder or the hub; its default branch where revision is None."""
        try:
            # Old CLIP checkpoints on the hub have no safetensors.
            folder, commit = fetch(
                name, revision, option="--retriever ", extra_patterns=["pytorch_model.bin"]
            )
            with wrap_loading_errors(name):
                model = _load_model(folder)
                self._tokenizer = transformers.AutoTokenizer.from_pretrained(folder)
                self._image_processor = load_image_processor(folder)
        except ModelError as error:
            raise UsageError(str(error)) from error
        self._model: Any = model.to(resolve_device(Placement())).eval()
        self._origin = origin(folder, commit, name)
        key = digest(json.dumps(self.identity(), sort_keys=True))
        file = user_cache("clip_vectors") / f"{key}.f32"
        self._vectors = VectorFile(file, model.config.projection_dim)

    def identity(self) -> dict[str, Any]:
        """Return everything that can change a ranking, as JSON values."""
        return self._origin | {
            "device": self._model.device.type,
            "image_processor": json.loads(self._image_processor.to_json_string()),
            "versions": versions(),
        }

    def frames(self, frames: Sequence[FrameRef]) -> np.ndarray:
        """Return the vectors of frames, (frames, dimensions)."""
        missing = {frame.digest: frame for frame in frames if frame.digest not in self._vectors}
        keys = list(missing)
        for at in range(0, len(keys), _BATCH):
            batch = keys[at : at + _BATCH]
            inputs = self._image_processor(
                images=[missing[key].load() for key in batch], return_tensors="pt"
            )
            self._embed(self._model.get_image_features, inputs, batch)
        return self._vectors.get([frame.digest for frame in frames])

    def text(self, text: str) -> np.ndarray:
        """Return a text's vector, (dimensions,); it is truncated to CLIP's limit (77 tokens)."""
        key = digest(f"text: {text}")
        if key not in self._vectors:
            limit = self._model.config.text_config.max_position_embeddings
            inputs = self._tokenizer([text], truncation=True, max_length=limit, return_tensors="pt")
            self._embed(self._model.get_text_features, inputs, [key])
        return self._vectors.get([key])[0]

    @torch.inference_mode()
    def _embed(self, features: Any, inputs: Any, keys: Sequence[str]) -> None:
        vectors = features(**inputs.to(self._model.device)).pooler_output
        self._vectors.add(keys, torch.nn.functional.normalize(vectors, dim=-1).cpu().numpy())


def _load_model(folder: Path) -> Any:
    model_type = transformers.AutoConfig.from_pretrained(folder).model_type
    if model_type != "clip":
        raise ModelError(
            f"--retriever {folder} is a {model_type} checkpoint; retrieval needs one of CLIP"
        )
    clip: Any = transformers.CLIPModel
    model, report = clip.from_pretrained(folder, dtype=torch.float32, output_loading_info=True)
    if report["missing_keys"]:  # transformers would draw them at random and only warn
        raise ModelError(
            f"--retriever {folder} lacks {len(report['missing_keys'])} weights; give a complete one"
        )
    return model


@lru_cache(maxsize=2)
def open_retriever(name: str, revision: str | None = None) -> Retriever:
    """Return the retriever of a checkpoint, which is loaded once per process; see `Retriever`."""
    return Retriever(name, revision)
