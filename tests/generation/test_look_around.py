"""Looking around: insertions as published, in lists of actions, in files, in generated sets."""

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.formats.trajectory import encode_trajectory, iter_sources, iter_trajectories
from infthor_eval.generation.factory import generate
from infthor_eval.generation.generate_set import generate_set
from infthor_eval.generation.look_around import (
    INSERTED,
    MIN_RUN,
    LevelWalk,
    inserted_before,
    level_walks,
    with_looks,
)
from infthor_eval.generation.look_around_set import look_around_files
from infthor_eval.generation.replay_set import replay_set, select
from infthor_eval.generation.replay_summary import summarise
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.storage.folders import packaged_folder

from ..helpers.command_line import assert_refused
from ..helpers.files import read_json_lines

GOLDENS = Path(__file__).parents[1] / "goldens"
BUNDLED = packaged_folder("sets/plans_mini") / "trajectories.jsonl.gz"
SETTINGS = TrajectorySettings("kitchen-31", 1, 40, 2, look_around=True)
WALKING = ("MoveAhead", "RotateLeft", "RotateRight")
OTHERS = ("LookUp", "LookDown", "PickupObject", "PutObject", "OpenObject")
TILT = {"LookUp": -30, "LookDown": 30}

stretches = st.lists(st.sampled_from(WALKING), max_size=9)
parts = st.tuples(stretches, st.lists(st.sampled_from(OTHERS), max_size=3))
action_lists = st.lists(parts, max_size=6).map(
    lambda found: [name for walk, rest in found for name in (*walk, *rest)]
)
horizons = st.sampled_from([-30, 0, 15, 30, 45, 60, 90])


@pytest.fixture(scope="module")
def made(simulator):
    return generate(SETTINGS, simulator).trajectory


def goldens(name):
    return read_json_lines(GOLDENS / name)


def looked(names, horizon=30, min_run=MIN_RUN):
    """The names with those inserted, in upper case."""
    walks = level_walks(names, horizon, min_run)
    return with_looks(names, walks, lambda name, _: name.upper())


def poses(names, horizon):
    """The horizon at each action that does not walk."""
    found = []
    for name in names:
        if name not in WALKING and not name.isupper():
            found.append(horizon)
        horizon += {**TILT, "LOOKUP": -30, "LOOKDOWN": 30}.get(name, 0)
    return [*found, horizon]


# -- lists of actions


def test_the_insertions_are_those_of_the_published_function():
    rows = goldens("look_around.jsonl.gz")
    assert len(rows) == 500
    assert sum(len(row["out"]) > len(row["names"]) for row in rows) > 200
    for row in rows:
        high = row["high_idx"]

        def look(name, walk, high=high):
            before = high[walk.first - 1] or 0
            owner = before if name == "LookUp" or high[walk.end] is None else high[walk.end]
            call = {"action": name, "renderImage": True}
            return {"api_action": call, "high_idx": owner, "inserted": INSERTED}

        walks = level_walks(row["names"], row["horizon"], row["min_run"])
        assert with_looks(range(len(high)), walks, look) == row["out"]


@given(action_lists, horizons, st.integers(1, 8))
def test_only_the_camera_moves_and_it_is_back_before_each_interaction(names, horizon, min_run):
    changed = looked(names, horizon, min_run)
    assert [name for name in changed if not name.isupper()] == names
    assert {name for name in changed if name.isupper()} <= {"LOOKUP", "LOOKDOWN"}
    assert poses(changed, horizon) == poses(names, horizon)


@given(action_lists, horizons)
def test_walks_are_long_and_level_and_with_an_empty_hand(names, horizon):
    for walk in level_walks(names, horizon):
        assert walk.end - walk.first >= MIN_RUN
        assert set(names[walk.first : walk.end]) <= set(WALKING)
        before = names[: walk.first]
        assert 0 <= poses(before, horizon)[-1] - 30 * walk.n_looks < 30
        hands = [name for name in before if name in ("PickupObject", "PutObject")]
        assert hands[-1:] != ["PickupObject"]


@given(action_lists, horizons)
def test_a_list_that_looks_around_has_nothing_to_insert(names, horizon):
    again = [{"LOOKUP": "LookUp", "LOOKDOWN": "LookDown"}.get(name, name) for name in
             looked(names, horizon)]  # fmt: skip
    assert level_walks(again, horizon) == []


def test_what_is_inserted_before_an_action_is_counted():
    walks = [LevelWalk(1, 7, 1), LevelWalk(8, 20, 2)]
    counts = [inserted_before(walks, index) for index in (0, 1, 6, 7, 8, 19, 20, 99)]
    assert counts == [0, 1, 1, 2, 4, 4, 6, 6]


# -- files


def test_files_are_written_byte_for_byte_as_by_the_published_script(tmp_path):
    rows = goldens("look_around_files.jsonl.gz")
    assert len(rows) == 40
    for number, row in enumerate(rows):
        source = tmp_path / "given.json"
        source.write_text(row["given"], encoding="utf-8")
        out = tmp_path / "new" / f"{number}.json"
        summary = look_around_files(source, out, row["min_run"])
        assert out.read_text() == row["written"]
        assert f"(+{summary.inserted} Look)" in row["said"]


def test_a_folder_is_written_under_the_same_names(run_cli, tmp_path):
    rows = [row for row in goldens("look_around_files.jsonl.gz") if row["min_run"] == MIN_RUN][:3]
    for number, row in enumerate(rows):
        file = tmp_path / "given" / str(number) / "traj_data.json"
        file.parent.mkdir(parents=True)
        file.write_text(row["given"])
    code, out, err = run_cli("look-around", tmp_path / "given", "--out", tmp_path / "new")
    assert (code, err) == (0, "")
    assert out.startswith("3 trajectories (")
    written = sorted((tmp_path / "new").rglob("*.json"))
    assert [file.read_text() for file in written] == [row["written"] for row in rows]


def _broken(document):
    document["sub_trajs"] = [{"sub_traj_idx": 0, "high_pddl_idx": [0, 1], "low_pddl_idx": [999, 1]}]


def _changed(document):
    document["plan"]["low_actions"][0]["inserted"] = INSERTED


@pytest.mark.parametrize(
    ("change", "said"),
    [(_broken, "a task has the actions 999 to 1, of "), (_changed, "looks around already")],
)
def test_what_cannot_be_changed_is_refused_in_one_line(run_cli, tmp_path, change, said):
    document = json.loads(goldens("look_around_files.jsonl.gz")[1]["given"])
    change(document)
    file = tmp_path / "given.json"
    file.write_text(json.dumps(document))
    assert_refused(run_cli("look-around", file, "--out", tmp_path / "new.json"), said)
    assert not (tmp_path / "new.json").exists()


@pytest.mark.parametrize(
    ("name", "said"), [("nowhere.json", "cannot be read"), ("a.jsonl", "not a .json file"),
                       ("none.json", "not a trajectory"), ("empty", "no .json")],
)  # fmt: skip
def test_what_is_no_trajectory_is_refused_in_one_line(run_cli, tmp_path, name, said):
    (tmp_path / "empty").mkdir()
    (tmp_path / "none.json").write_text("[1]")
    (tmp_path / "a.jsonl").write_text("{}\n")
    assert_refused(run_cli("look-around", tmp_path / name, "--out", tmp_path / "out"), said)


def test_a_file_that_cannot_be_written_is_told(run_cli, tmp_path):
    file = tmp_path / "given.json"
    file.write_text(goldens("look_around_files.jsonl.gz")[1]["given"])
    for out, said in ((tmp_path, "not a file"), (file / "x", "cannot be written to")):
        ended = run_cli("look-around", file, "--out", out)
        assert_refused(ended, said, "another place with --out")


def test_what_a_file_tells_of_its_generation_may_be_null(tmp_path):
    document = json.loads(goldens("look_around_files.jsonl.gz")[1]["given"]) | {"gen_info": None}
    (tmp_path / "given.json").write_text(json.dumps(document))
    look_around_files(tmp_path / "given.json", tmp_path / "new.json")
    info = json.loads((tmp_path / "new.json").read_text())["gen_info"]
    assert list(info) == ["look_around_retrofit"]


def test_a_bundled_trajectory_that_looks_around_is_replayed(simulator, tmp_path):
    source = next(iter_sources(BUNDLED))
    (tmp_path / "given.json").write_bytes(source.raw)
    summary = look_around_files(tmp_path / "given.json", tmp_path / "new.json")
    assert summary.inserted >= 2
    replayed = replay_set(select([tmp_path / "new.json"]), simulator, tmp_path / "set")
    assert not replayed.failures
    assert summarise(replayed).complete == 1
    (copy,) = iter_trajectories(tmp_path / "new.json")
    assert sum(low.inserted == INSERTED for low in copy.plan.low_actions) == summary.inserted


# -- generated sets


def test_a_generated_trajectory_looks_around_and_is_replayed(made, simulator, tmp_path):
    actions = made.plan.low_actions
    added = [low.api_action.action for low in actions if low.inserted == INSERTED]
    assert added.count("LookUp") == added.count("LookDown") >= 1
    assert [low.low_idx for low in actions] == list(range(len(actions)))
    assert len(made.object_log) == len(actions) + 1
    assert made.gen_info["look_around"] is True
    (tmp_path / "made.json").write_bytes(encode_trajectory(made))
    replayed = replay_set(select([tmp_path / "made.json"]), simulator, tmp_path / "set")
    assert summarise(replayed).complete == 1
    (read,) = iter_trajectories(tmp_path / "made.json")
    assert read == made


def test_apart_from_what_is_inserted_the_actions_are_the_same(made, simulator):
    without = generate(TrajectorySettings("kitchen-31", 1, 40, 2), simulator).trajectory
    assert without.gen_info["look_around"] is False
    assert b'"inserted"' not in encode_trajectory(without)
    kept = [low for low in made.plan.low_actions if low.inserted != INSERTED]
    both = list(zip(kept, without.plan.low_actions, strict=False))
    assert len(both) >= 30
    for one, other in both:
        for name in ("api_action", "discrete_action", "high_idx"):
            assert getattr(one, name) == getattr(other, name)


def test_a_generation_is_resumed_with_the_same_option_alone(simulator, tmp_path):
    job = TrajectorySettings("kitchen-31", 1, 20, 1, look_around=True)
    assert generate_set([job], simulator, tmp_path).resumed == 0
    assert generate_set([job], simulator, tmp_path).resumed == 1
    other = TrajectorySettings("kitchen-31", 1, 20, 1)
    (failure,) = generate_set([other], simulator, tmp_path).failures
    assert "generated with other settings" in failure
