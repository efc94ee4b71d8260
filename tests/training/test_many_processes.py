"""Sequences cut over two and four processes: the loss and the gradients of one."""

import multiprocessing
from pathlib import Path
from typing import Any

import pytest
import torch
import torch.multiprocessing
from torch import Tensor

from infthor_eval.formats.frames import FrameRef
from infthor_eval.training.batches import IGNORED, n_labels
from infthor_eval.training.context_parallel import SequenceSplit
from infthor_eval.training.ranks import Ranks

from .processes import CASES, N_RANKS, RESULTS, Case, CaseResult, batch_of, model_of, train, work
from .twins import gradients_of, loaded, write_frames

TOLERANCE, DOUBLE = 1e-5, 1e-9  # of single and of double precision


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("processes")


@pytest.fixture(scope="module")
def frames(folder: Path) -> list[FrameRef]:
    return write_frames(folder / "frames", 5)


@pytest.fixture(scope="module")
def results(folder: Path, frames: list[FrameRef]) -> Any:
    # Forked from a process that has imported everything once, which takes longer than the work.
    multiprocessing.get_context("forkserver").set_forkserver_preload([work.__module__])
    torch.multiprocessing.start_processes(
        work, (folder, frames), nprocs=N_RANKS, start_method="forkserver"
    )
    return torch.load(folder / RESULTS, weights_only=False)


@pytest.fixture(scope="module", params=CASES, ids=str)
def alone(request: pytest.FixtureRequest, frames: list[FrameRef]) -> tuple[Case, CaseResult]:
    """A case, and what comes of it in one process without recomputation."""
    case: Case = request.param
    model, batch = model_of(case), batch_of(case, frames)
    model.gradient_checkpointing_disable()
    loss = model(**batch)["loss"]
    loss.backward()
    return case, CaseResult([loss.item()], gradients_of(model))


def _assert_equal(
    result: dict[str, Tensor], expected: dict[str, Tensor], tolerance: float = TOLERANCE
) -> None:
    assert result.keys() == expected.keys()
    whole = torch.stack([one.norm() for one in expected.values()]).norm()
    for name, one in expected.items():
        # Some gradients are 0 but for rounding (those of the biases of keys): these are held
        # against the whole.
        scale = max(one.norm(), 1e-3 * whole)
        assert (result[name] - one).norm() <= tolerance * scale, name


@pytest.mark.parametrize("n_context", [2, 4])
def test_a_cut_sequence_has_the_loss_and_gradients_of_the_whole(results, alone, n_context):
    case, expected = alone
    result: CaseResult = results[case, n_context]
    assert sum(result.shares) == pytest.approx(expected.shares[0], rel=TOLERANCE)
    _assert_equal(result.gradients, expected.gradients)


def test_the_cases_are_the_hard_ones(results, frames):
    batch = batch_of(CASES[0], frames)
    n_tokens = batch["input_ids"].shape[1]
    assert n_tokens % 4
    assert n_tokens % 8
    # With the vision tower alone trained, a rank without features has nothing of its own that wants
    # a gradient.
    parts = [SequenceSplit(rank, 4).local_part(batch["slots"], False) for rank in range(4)]
    assert [bool(part.any()) for part in parts] == [False, True, True, True]
    borders = [-(-n_tokens // 8) * number for number in range(1, 8)]
    assert any(batch["slots"][0, border - 1] and batch["slots"][0, border] for border in borders)
    assert any(batch["labels"][0, border] != IGNORED for border in borders)
    shares = results[CASES[1], 4].shares
    assert shares[0] > 0
    assert shares[1:] == [0, 0, 0]


def test_data_groups_of_cut_sequences_train_as_one_process(results, frames, folder):
    expected = train(loaded("qwen2.5-vl"), folder / "alone", frames, Ranks())
    assert len(expected) == 2
    for result, one in zip(results["loop"], expected, strict=True):
        assert result.loss == pytest.approx(one.loss, rel=DOUBLE)
        assert result.gradient_norm == pytest.approx(one.gradient_norm, rel=DOUBLE)
        for name in ("step", "n_steps", "learning_rate"):
            assert getattr(result, name) == getattr(one, name)
    ours, theirs = (_moments(folder / name) for name in ("loop", "alone"))
    _assert_equal(ours, theirs, DOUBLE)


def _moments(folder: Path) -> dict[str, Tensor]:
    """The optimizer's sums of gradients."""
    (state,) = folder.glob("step-*/optimizer.pt")
    (optimizer,) = torch.load(state, weights_only=True)
    return {str(number): moments["exp_avg"] for number, moments in optimizer["state"].items()}


def test_nothing_is_left_behind(results):
    assert results["left behind"] == []


def test_weights_in_shards_are_written_whole(results):
    assert results["out of shards"] is True


def test_what_cannot_be_cut_is_refused(results):
    assert "attends in windows of 8 tokens" in results["refused"]["sliding"]
    three = results["refused"]["three"]
    assert three == "4 processes cannot share sequences by 3; give a divisor of 4"


def test_labels_are_counted_over_the_whole_sequence(frames):
    batch = batch_of(CASES[0], frames)
    text = int((~batch["slots"]).sum())
    assert n_labels(batch) == text - 1
