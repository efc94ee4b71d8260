"""Sets of twins without frames, from which the same frames are drawn again."""

import json
import shutil
from functools import partial

import pyarrow as pa
import pytest

from infthor_eval.errors import DataError, UsageError
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.step_log import read_steps
from infthor_eval.formats.twins import read_pairs
from infthor_eval.formats.undrawn import DIGESTS, WORLDS, drawn_folder, is_drawn, is_undrawn
from infthor_eval.generation.replay_set import select
from infthor_eval.generation.twins.drafting import TwinSettings, draft_twins
from infthor_eval.generation.twins.twin_set import make_twins
from infthor_eval.generation.twins.undrawn import draw_worlds, expected_digests, pack_worlds
from infthor_eval.nieh import samples
from infthor_eval.nieh.scoring import score
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator
from infthor_eval.workers import WorkerSettings

from ...helpers.command_line import read_success


@pytest.fixture(scope="module")
def whole(file, tmp_path_factory):
    """A set with frames."""
    out = tmp_path_factory.mktemp("twins") / "set"
    make_twins(
        select([file]),
        embedded_launch(),
        out,
        TwinSettings(("count-open", "put-target"), per_kind=1, rungs=(3, 6)),
        partial(draft_twins, score=partial(score, scorer="strict")),
        worker_settings=WorkerSettings(),
    )
    return out


@pytest.fixture
def packed(whole, tmp_path):
    out = tmp_path / "sets" / "nieh_mini_twins"
    out.mkdir(parents=True)
    pack_worlds(whole, out)
    return out


def test_frames_and_logs_are_those_of_the_set_up_to_the_last_sub_goal_asked_about(
    whole, packed, tmp_path
):
    drawn = tmp_path / "drawn"
    drawn.mkdir()
    assert draw_worlds(packed, drawn, WorkerSettings()) == []
    original, again = NiehSet(whole), NiehSet(drawn)
    assert [repr(it) for it in original.questions] == [repr(it) for it in again.questions]
    n_shorter = 0
    pairs = zip(read_pairs(whole), read_pairs(drawn), strict=True)
    for before, after in pairs:
        assert before.questions == after.questions
        last = max(question.moment for question in before.questions)
        for name in before.traj_ids:
            frames = [frame.path.read_bytes() for frame in again.frames(name)]
            assert len(frames) == len(after.frames) > last
            n_shorter += len(frames) < len(before.frames)
            known = original.frames(name)[: len(frames)]
            assert frames == [frame.path.read_bytes() for frame in known]
            steps = read_steps(again.folder(name))
            assert steps == read_steps(original.folder(name))[: len(frames)]
    assert n_shorter
    assert len(expected_digests(packed)) == len(
        {name for pair in read_pairs(drawn) for name in pair.traj_ids}
    )
    assert not list(packed.rglob("*.png"))


def test_what_is_drawn_already_is_not_drawn_again_and_what_differs_is_named(
    packed, tmp_path, monkeypatch
):
    drawn = tmp_path / "drawn"
    drawn.mkdir()
    draw_worlds(packed, drawn, WorkerSettings())
    digests = json.loads((packed / DIGESTS).read_text())
    first, second, *_ = digests
    (packed / DIGESTS).write_text(json.dumps({**digests, second: "0"}))
    shutil.rmtree(drawn / "metadata" / first)
    steps = []
    step = Simulator.step
    monkeypatch.setattr(
        Simulator,
        "step",
        lambda self, action, **more: steps.append(action) or step(self, action, **more),
    )
    assert draw_worlds(packed, drawn, WorkerSettings()) == [second]
    assert (drawn / "metadata" / first / "traj_data.json").is_file()
    assert 0 < len(steps) < 60


def test_a_world_that_cannot_be_carried_out_is_named(packed, tmp_path):
    lines = pa.input_stream(str(packed / WORLDS)).read().decode().splitlines()
    world = json.loads(lines[0])
    world["plan"]["low_actions"][0]["api_action"] = {"action": "OpenObject", "objectId": "Sofa|1"}
    content = "\n".join([json.dumps(world), *lines[1:]]) + "\n"
    content = pa.Codec("zstd").compress(content.encode(), asbytes=True)
    (packed / WORLDS).write_bytes(content)
    with pytest.raises(DataError, match=rf"{world['traj_id']}: OpenObject is refused"):
        draw_worlds(packed, tmp_path, WorkerSettings())


def test_a_run_draws_the_frames_once(packed, run_cli, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    for module in ("infthor_eval.nieh.samples", "infthor_eval.cli.progress.undrawn"):
        monkeypatch.setattr(
            f"{module}.packaged_folder", lambda name: packed if "/" in name else packed.parent
        )
    assert is_undrawn(packed) and not is_drawn(packed)
    with pytest.raises(UsageError, match="draws them, once"):
        samples.find_set(bundled="nieh_mini_twins")
    run = ("--tasks", "nieh_mini_twins", "--context", "trajectory", "--model", "oracle")
    first = run_cli("run", *run, "--output", tmp_path / "one")
    assert "comes without frames" in read_success(first)[1]
    assert is_drawn(packed) and samples.find_set(bundled="nieh_mini_twins").root == drawn_folder(
        packed
    )
    second = run_cli("run", *run, "--output", tmp_path / "two")
    assert "comes without frames" not in read_success(second)[1]
    (file,) = (tmp_path / "two").glob("oracle/*/results.json")
    pairs = json.loads(file.read_text())["summary"]["tasks"]["nieh_mini_twins"]["pairs"]
    assert pairs["net_pairs"]["mean"] == 1.0
