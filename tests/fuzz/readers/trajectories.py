"""Trajectories: as files, by the suites that act along them, and replayed."""

import gzip
import json
import shutil
from functools import cache
from pathlib import Path
from typing import Any

from infthor_eval.episodes.trajectory_sets import find_trajectories
from infthor_eval.errors import InfthorError
from infthor_eval.formats.object_ids import Words
from infthor_eval.formats.trajectory import iter_sources
from infthor_eval.generation.replay_set import replay_set, select
from infthor_eval.manipulation.trajectories import read_arm_trajectory
from infthor_eval.plans.trajectories import read_plan_trajectory
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.thor.supplement import write_supplement

from ..damage import Form
from ..reader import Reader
from .samples import GOOD, trajectory_document

__all__ = ["READERS"]


def _make(folder: Path) -> Path:
    (folder / "b.json").write_text(json.dumps(trajectory_document(GOOD)))
    (folder / "a.json").write_text(json.dumps(trajectory_document("bad")))
    return folder / "a.json"


def _make_lines(folder: Path) -> Path:
    path = folder / "a.jsonl.gz"
    path.write_bytes(
        gzip.compress(
            "".join(json.dumps(trajectory_document(f"t{n}")) + "\n" for n in range(2)).encode()
        )
    )
    return path


def _read(folder: Path) -> None:
    selected = select([folder])
    names = [trajectory.traj_id for _, trajectory in selected.items]
    assert GOOD in names, f"the good one does not come: {names}"
    _hold_lines(failure.message for failure in selected.failures)
    write_supplement([trajectory for _, trajectory in selected.items], folder / "supplement")
    for read in (lambda source: read_plan_trajectory(source, Words.NATURAL), read_arm_trajectory):
        known = find_trajectories(folder, None, read)
        assert any(item.traj_id == GOOD for item in known.trajectories)
        _hold_lines(reason for _, reason in known.broken)


def _read_lines(folder: Path) -> None:
    for source in iter_sources(folder / "a.jsonl.gz"):
        try:
            source.read()
        except InfthorError as error:
            _hold_lines([str(error)])


@cache
def _simulator() -> Simulator:
    return Simulator(embedded_launch(), width=64, height=64)


def _replay(folder: Path) -> None:
    simulator, out = _simulator(), folder / "set"
    shutil.rmtree(out, ignore_errors=True)
    n_restarts = simulator.restarts
    replayed = replay_set(select([folder]), simulator, out)
    assert any(report.traj_id == GOOD for report in replayed.reports), (
        "the good one is not replayed"
    )
    assert simulator.restarts == n_restarts, "the simulator died"
    _hold_lines(failure.message for failure in replayed.failures)


def _hold_lines(messages: Any) -> None:
    for message in messages:
        assert "\n" not in message and len(message) < 1000, f"no single line: {message[:300]!r}"


READERS = (
    Reader("trajectory", Form.JSON, _make, _read),
    Reader("trajectory lines", Form.PACKED_LINES, _make_lines, _read_lines),
    Reader("replay", Form.JSON, _make, _replay),
)
