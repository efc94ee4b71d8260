"""Several episodes at once: each has a simulator to itself, and they find what one after the other finds."""

import gc
import os
from pathlib import Path

import msgspec

from infthor_eval.agents.baselines import BASELINES
from infthor_eval.agents.simulators import Simulators
from infthor_eval.runs import execute
from model_adapters import Capabilities

from .cut import CANDLE, FORK, MUG, cut, write


def children():
    return set(Path(f"/proc/self/task/{os.getpid()}/children").read_text().split())


def test_a_simulator_is_used_again_by_the_next_and_by_nobody_at_the_same_time():
    simulators = Simulators("embedded", None, [], image=False, instances=False)
    with simulators.one() as first, simulators.one() as second:
        assert first is not second
    with simulators.one() as again:
        assert again in (first, second)
    assert (first.label, first.restarts) == ("embedded", 0)


def test_four_episodes_at_once_find_what_one_after_the_other_finds(prepared, tmp_path, monkeypatch):
    data = write(tmp_path / "three", cut(FORK, 2), cut(MUG, 2), cut(CANDLE, 3))
    before = children()
    together = execute(prepared("random", data=data, output=tmp_path / "together"))
    n_started = len(children() - before)
    assert BASELINES["random"](0).capabilities.max_in_flight == 4
    one_by_one = Capabilities(counts_tokens=False, token_ids=False)
    monkeypatch.setattr(BASELINES["random"], "capabilities", one_by_one)
    alone = execute(prepared("random", data=data, output=tmp_path / "alone"))

    def timeless(outcome):
        return [msgspec.structs.replace(record, seconds=0.0) for record in outcome.records]

    assert timeless(together) == timeless(alone)
    assert together.summary == alone.summary
    assert len(together.records) == 7
    assert 1 < n_started <= 3
    del together, alone
    gc.collect()
    assert not children() - before  # simulators end with their runs
