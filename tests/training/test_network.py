"""Losses of whole models: against transformers' own, with parts frozen, with activations computed
again."""

from pathlib import Path
from typing import Any

import pytest
import torch
from torch import Tensor

from infthor_eval.errors import ModelError, UsageError
from infthor_eval.training.batches import Batch, collate, n_labels
from infthor_eval.training.encoding import TrainingSequence
from infthor_eval.training.network import PARTS, SequenceModel, freeze, parameters_by_part
from model_adapters.hf.loading.loaded import LoadedCheckpoint

from .twins import FAMILIES, PAD, everywhere, gradients_of, loaded, sequence, write_frames


@pytest.fixture(params=FAMILIES)
def checkpoint(request: pytest.FixtureRequest) -> LoadedCheckpoint:
    return loaded(request.param)


@pytest.fixture
def qwen() -> LoadedCheckpoint:
    return loaded("qwen2.5-vl")


def _two(checkpoint: LoadedCheckpoint, folder: Path) -> list[TrainingSequence]:
    frames = write_frames(folder, 2)
    return [
        sequence(checkpoint, frames[:1], "a mug"),
        everywhere(sequence(checkpoint, frames[1:], "two forks")),
    ]


def _batch(checkpoint: LoadedCheckpoint, folder: Path) -> Batch:
    return collate(_two(checkpoint, folder), checkpoint.family, PAD)


def _gradients(model: SequenceModel, batch: Batch) -> dict[str, Tensor]:
    model.zero_grad()
    model(**batch)["loss"].backward()
    return gradients_of(model)


def _own_loss(checkpoint: LoadedCheckpoint, batch: Batch) -> Tensor:
    """transformers' own loss, from ids and pixels."""
    family: Any = checkpoint.family
    images = [frame.ref.load() for frame in batch["frames"]]
    inputs = dict(family._image_processor(images=images, return_tensors="pt"))
    if hasattr(checkpoint.model.model, "get_rope_index"):
        inputs["mm_token_type_ids"] = (batch["input_ids"] == family.slot_id).int()
    inputs |= {name: batch[name] for name in ("input_ids", "attention_mask", "labels")}
    loss: Tensor = checkpoint.model(**inputs).loss
    return loss


def test_the_loss_is_transformers_own(checkpoint, tmp_path):
    batch = _batch(checkpoint, tmp_path)
    with torch.no_grad():
        result, expected = SequenceModel(checkpoint)(**batch)["loss"], _own_loss(checkpoint, batch)
    torch.testing.assert_close(result, expected, rtol=1e-5, atol=0)


def test_gradients_are_transformers_own(qwen, tmp_path):
    batch = _batch(qwen, tmp_path)
    model = SequenceModel(qwen)
    result = _gradients(model, batch)
    model.zero_grad()
    _own_loss(qwen, batch).backward()
    assert len(result) == len(list(model.parameters()))
    torch.testing.assert_close(result, gradients_of(model), rtol=1e-4, atol=1e-5)


def test_a_batch_has_the_loss_of_its_sequences_by_tokens(checkpoint, tmp_path):
    model, two = SequenceModel(checkpoint), _two(checkpoint, tmp_path)
    batches = [collate([one], checkpoint.family, PAD) for one in two]
    n_items = sum(map(n_labels, batches))
    with torch.no_grad():
        whole = model(**collate(two, checkpoint.family, PAD))["loss"]
        parts = [
            model(**batch, num_items_in_batch=torch.tensor(n_items))["loss"] for batch in batches
        ]
    torch.testing.assert_close(parts[0] + parts[1], whole, rtol=1e-5, atol=0)


def test_every_parameter_is_in_one_part(checkpoint):
    model = SequenceModel(checkpoint)
    by_part = parameters_by_part(model)
    assert tuple(by_part) == PARTS
    everything = [id(one) for parameters in by_part.values() for one in parameters]
    assert len(set(everything)) == len(everything)
    assert set(everything) == {id(one) for one in model.parameters()}
    assert all(by_part.values())


@pytest.mark.parametrize(
    "parts", [("vision",), ("vision", "embeddings"), ("decoder",), ("embeddings", "head")]
)
def test_what_is_frozen_has_no_gradient(checkpoint, parts, tmp_path):
    model = SequenceModel(checkpoint)
    batch = _batch(checkpoint, tmp_path)
    before = _gradients(model, batch)
    freeze(model, parts)
    after = _gradients(model.train(), batch)
    frozen = {id(one) for part in parts for one in parameters_by_part(model)[part]}
    expected = {
        name for name, one in model.named_parameters() if id(one) not in frozen and name in before
    }
    kept = {name: before[name] for name in expected}
    torch.testing.assert_close(after, kept, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("frozen", [(), ("vision", "embeddings")])
def test_activations_can_be_computed_again(checkpoint, frozen, tmp_path):
    model = SequenceModel(checkpoint).train()
    freeze(model, frozen)
    batch = _batch(checkpoint, tmp_path)
    before = _gradients(model, batch)
    n_kept = _n_kept(model, batch)
    model.gradient_checkpointing_enable()
    assert _n_kept(model, batch) < n_kept
    after = _gradients(model, batch)
    torch.testing.assert_close(after, before, rtol=1e-4, atol=1e-5)
    model.gradient_checkpointing_disable()
    assert _n_kept(model, batch) == n_kept


def _n_kept(model: SequenceModel, batch: Batch) -> int:
    """How many tensors are kept for the gradient."""
    kept: list[object] = []
    with torch.autograd.graph.saved_tensors_hooks(
        lambda one: kept.append(None) or one, lambda one: one
    ):
        model(**batch)
    return len(kept)


def test_a_frame_that_stands_twice_is_computed_once(qwen, tmp_path, monkeypatch):
    first, second = write_frames(tmp_path, 2)
    batch = collate([sequence(qwen, [first, second, first])], qwen.family, PAD)
    n_images: list[int] = []
    compute = qwen.family.features
    monkeypatch.setattr(
        qwen.family, "features", lambda images: n_images.append(len(images)) or compute(images)
    )
    SequenceModel(qwen)(**batch)
    assert n_images == [2]


def test_sequences_without_frames_are_trained_on_too(qwen):
    batch = collate([sequence(qwen, [])], qwen.family, PAD)
    assert torch.isfinite(SequenceModel(qwen)(**batch)["loss"])


def test_parts_of_two_checkpoints_are_told_apart(qwen, tmp_path, monkeypatch):
    batch = _batch(qwen, tmp_path)
    compute = qwen.family.features
    monkeypatch.setattr(
        qwen.family, "features", lambda images: [one[1:] for one in compute(images)]
    )
    with pytest.raises(ModelError, match="9 image tokens of a frame and the model 8 features"):
        SequenceModel(qwen)(**batch)


def test_weights_that_two_parts_share_are_frozen_in_both_or_neither(qwen):
    qwen.model.get_output_embeddings().weight = qwen.model.get_input_embeddings().weight
    model = SequenceModel(qwen)
    with pytest.raises(UsageError, match="the same weights in this model; freeze both"):
        freeze(model, ["vision", "embeddings"])
    freeze(model, ["embeddings", "head"])
    assert not qwen.model.get_output_embeddings().weight.requires_grad


def test_unknown_parts_and_freezing_all_are_refused(qwen):
    model = SequenceModel(qwen)
    with pytest.raises(UsageError, match="unknown part of a model 'visio'; did you mean 'vision'"):
        freeze(model, ["visio"])
    with pytest.raises(UsageError, match="nothing is left to train"):
        freeze(model, PARTS)
