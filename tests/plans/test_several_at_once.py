"""Several episodes at once: each has a simulator to itself, and they find what one after the other
finds."""

import msgspec

from infthor_eval.plans.actors.baselines import BASELINES
from infthor_eval.runs import execute
from model_adapters import Capabilities

from ..helpers.processes import ChildCounter, find_children
from ..helpers.trajectories import CANDLE, FORK, MUG, cut_trajectory, write_trajectories


def test_four_episodes_at_once_find_what_one_after_the_other_finds(
    prepare_run, tmp_path, monkeypatch
):
    data = write_trajectories(
        tmp_path / "three",
        cut_trajectory(FORK, 2),
        cut_trajectory(MUG, 2),
        cut_trajectory(CANDLE, 3),
    )
    counting = ChildCounter()
    together = execute(prepare_run("random", data=data, output=tmp_path / "together"), counting)
    assert 1 < counting.most <= 3
    assert not find_children() - counting.before  # simulators end with their runs
    assert BASELINES["random"](0).capabilities.max_in_flight == 4
    one_by_one = Capabilities(counts_tokens=False, token_ids=False)
    monkeypatch.setattr(BASELINES["random"], "capabilities", one_by_one)
    alone = execute(prepare_run("random", data=data, output=tmp_path / "alone"))

    def timeless(outcome):
        return [msgspec.structs.replace(record, seconds=0.0) for record in outcome.records]

    assert timeless(together) == timeless(alone)
    assert together.summary == alone.summary
    assert len(together.records) == 7
