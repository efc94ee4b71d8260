"""Sequences side by side: what is expanded, padded, labelled and numbered."""

from dataclasses import replace
from itertools import compress

import pytest
import torch

from infthor_eval.errors import DataError
from infthor_eval.training.batches import IGNORED, collate, n_labels
from infthor_eval.training.encoding import TrainingSequence
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.prompting.prompt import token_ids

from .twins import loaded, sequence, write_frames

PAD = 7


@pytest.fixture(scope="module", params=["qwen2.5-vl", "pixtral"])
def model(request: pytest.FixtureRequest) -> LoadedCheckpoint:
    return loaded(request.param)


@pytest.fixture(scope="module")
def two(
    model: LoadedCheckpoint, tmp_path_factory: pytest.TempPathFactory
) -> list[TrainingSequence]:
    frames = write_frames(tmp_path_factory.mktemp("frames"), 3)
    return [
        sequence(model, frames, "a mug", "long"),
        sequence(model, frames[1:2], "a fork and a spoon", "short"),
    ]


def test_frames_are_expanded_and_the_end_is_padded(model, two):
    batch = collate(two, model.family, PAD)
    long, short = (one.n_tokens for one in two)
    assert batch["input_ids"].shape == (2, long)
    assert batch["input_ids"][0].tolist() == list(token_ids(two[0].pieces))
    assert batch["input_ids"][1].tolist() == [*token_ids(two[1].pieces), *[PAD] * (long - short)]
    assert batch["attention_mask"] is not None
    assert batch["attention_mask"].tolist() == [[1] * long, [1] * short + [0] * (long - short)]


def test_nothing_is_masked_where_nothing_is_padded(model, two):
    assert collate([two[0], two[0]], model.family, PAD)["attention_mask"] is None


def test_labels_are_the_tokens_that_loss_is_taken_on(model, two):
    batch = collate(two, model.family, PAD)
    for one, labels in zip(two, batch["labels"], strict=True):
        learned = list(compress(one.pieces, one.has_loss))
        assert labels[labels != IGNORED].tolist() == learned
    assert n_labels(batch) == sum(one.n_loss_tokens for one in two)
    at = batch["labels"] != IGNORED
    assert torch.equal(batch["labels"][at], batch["input_ids"][at])


def test_slots_are_where_frames_put_their_features(model, two):
    batch = collate(two, model.family, PAD)
    digests = [frame.digest for one in two for frame in one.frames]
    assert [frame.digest for frame in batch["frames"]] == digests
    slot = model.family.slot_id
    assert batch["slots"].sum() == sum(frame.ids.count(slot) for frame in batch["frames"])
    assert (batch["input_ids"][batch["slots"]] == slot).all()


def test_a_batch_has_the_positions_of_its_sequences(model, two):
    batch = collate(two, model.family, PAD)
    for row, one in enumerate(two):
        ids = torch.tensor(list(token_ids(one.pieces)))
        expected = model.family.positions(ids, [frame.size for frame in one.frames], 0)
        positions = batch["position_ids"][..., row, :]
        assert torch.equal(positions[..., : len(ids)], expected[..., 0, :])
        assert not positions[..., len(ids) :].any()


def test_the_first_token_is_predicted_by_nothing(model, two):
    everywhere = replace(two[1], has_loss=tuple(isinstance(piece, int) for piece in two[1].pieces))
    assert n_labels(collate([everywhere], model.family, PAD)) == everywhere.n_loss_tokens - 1


def test_a_sequence_without_labels_is_refused(model, two):
    masked = replace(two[1], has_loss=(False,) * len(two[1].has_loss))
    with pytest.raises(DataError, match="short: no token has loss"):
        collate([two[0], masked], model.family, PAD)
