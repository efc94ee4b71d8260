"""Several answers to the same frames in one sequence."""

import pytest
import torch

from infthor_eval.training.batches import Batch, collate
from infthor_eval.training.encoding import TrainingSequence
from infthor_eval.training.network import SequenceModel
from model_adapters.hf.loading.loaded import LoadedCheckpoint
from model_adapters.hf.prompting.prompt import n_common, token_ids
from recipes.nano.reading.branches import BranchedSequence, collate_branched, with_branches

from ....training.twins import loaded, sequence, write_frames

PAD = 7


@pytest.fixture(scope="module", params=["qwen2.5-vl", "pixtral"])
def model(request: pytest.FixtureRequest) -> LoadedCheckpoint:
    return loaded(request.param)


def join(apart: list[TrainingSequence]) -> BranchedSequence:
    """Sequences that begin alike as one; the first piece with loss comes behind one of its own."""
    firsts = [one.has_loss.index(True) - 1 for one in apart]
    n = min(n_common([one.pieces for one in apart]), *firsts)
    head, *_ = (TrainingSequence("head", one.pieces[:n], one.has_loss[:n]) for one in apart)
    tails = [TrainingSequence("tail", one.pieces[n:], one.has_loss[n:]) for one in apart]
    return with_branches("joined", head, tails)


@pytest.fixture(scope="module")
def branched(
    model: LoadedCheckpoint, tmp_path_factory: pytest.TempPathFactory
) -> tuple[list[TrainingSequence], BranchedSequence]:
    """Three answers on the same frames, and all of them in one sequence."""
    frames = write_frames(tmp_path_factory.mktemp("frames"), 2)
    apart = [sequence(model, frames, answer) for answer in ("a mug", "a fork and a spoon", "no")]
    return apart, join(apart)


def test_branches_have_their_beginning_once(
    branched: tuple[list[TrainingSequence], BranchedSequence],
) -> None:
    apart, joined = branched
    before, *rest = joined.spans
    assert len(rest) == 3
    for one, span in zip(apart, rest, strict=True):
        assert (*joined.pieces[before], *joined.pieces[span]) == one.pieces
        assert (*joined.has_loss[before], *joined.has_loss[span]) == one.has_loss
        assert not joined.has_loss[span.start]
    assert joined.n_tokens < sum(one.n_tokens for one in apart) / 2


def test_a_branch_has_the_place_that_it_has_alone_and_sees_no_other(
    model: LoadedCheckpoint, branched: tuple[list[TrainingSequence], BranchedSequence]
) -> None:
    apart, joined = branched
    batch = collate_branched([joined, with_branches("one", apart[0], [])], model.family, PAD)
    seen = batch["attention_mask"]
    assert seen is not None
    n_before = len(list(token_ids(joined.pieces[joined.spans[0]])))
    start = n_before
    for one in apart:
        n_own = one.n_tokens - n_before
        at = [*range(n_before), *range(start, start + n_own)]
        alone = collate([one], model.family, PAD)
        assert torch.equal(batch["position_ids"][..., 0, at], alone["position_ids"][..., 0, :])
        last = seen[0, 0, start + n_own - 1]
        assert last.nonzero()[:, 0].tolist() == at
        start += n_own
    n_short = apart[0].n_tokens
    assert torch.equal(
        seen[1, 0, :n_short, :n_short], torch.ones(n_short, n_short, dtype=torch.bool).tril()
    )
    assert seen.any(-1).all()


def test_the_loss_of_branches_is_that_of_their_sequences(
    model: LoadedCheckpoint, branched: tuple[list[TrainingSequence], BranchedSequence]
) -> None:
    apart, joined = branched
    network = SequenceModel(model)

    def loss(batch: Batch) -> float:
        with torch.no_grad():
            return float(network(**batch, num_items_in_batch=1)["loss"])

    alone = [loss(collate([one], model.family, PAD)) for one in apart]
    assert loss(collate_branched([joined], model.family, PAD)) == pytest.approx(
        sum(alone), rel=1e-4
    )
    beside = [joined, with_branches("one", apart[1], [])]
    assert loss(collate_branched(beside, model.family, PAD)) == pytest.approx(
        sum(alone) + alone[1], rel=1e-4
    )
