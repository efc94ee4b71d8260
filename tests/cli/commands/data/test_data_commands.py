"""`generate`, `replay` and `questions`, one after the other, as a user types them."""

import contextlib
import gzip
import io
import json
import shutil

import pytest
from ai2thor._quality_settings import QUALITY_SETTINGS

from infthor_eval.cli import main
from infthor_eval.cli.commands.data.replay import QUALITIES, parse_form
from infthor_eval.formats.qa_csv import read_questions

from ....helpers.command_line import assert_refused, option_words, read_success
from ....infthor_sim.test_houses import furnished_house

_FEW = ("--per-trajectory", 5)


def _type(*arguments: object) -> str:
    """What our command prints, in a fixture of the module, which has no `run_cli`."""
    output = io.TextIOWrapper(io.BytesIO())
    with contextlib.redirect_stdout(output), pytest.raises(SystemExit) as ended:
        main([*map(str, arguments)])
    assert ended.value.code == 0
    output.seek(0)
    return output.read()


def _print(*arguments: object) -> dict:
    """What it prints with --json."""
    return json.loads(_type(*arguments, "--json"))


@pytest.fixture(scope="module")
def printed(work):
    """What `generate`, `replay` and `questions` print when they make the set of this module."""
    scene = ("--scene", "kitchen-5", "--min-steps", 60, "--min-subgoals", 2, "--seed", 1)
    generated = _print("generate", *scene, "--out", work / "trajectories")
    replayed = _print("replay", work / "trajectories", "--out", work / "set")
    csv = work / "set/qa_set_mine.csv"
    return generated, replayed, _type("questions", work / "set", "--out", csv, *_FEW)


@pytest.fixture(scope="module")
def work(tmp_path_factory):
    return tmp_path_factory.mktemp("work")


@pytest.fixture(scope="module")
def made_folder(printed, work):
    """The folder of the trajectory and its set."""
    return work


@pytest.mark.slow
def test_a_trajectory_in_a_house_carries_it_to_all_commands(tmp_path, run_cli):
    (tmp_path / "made").mkdir()
    (tmp_path / "made/my.json").write_text(json.dumps(furnished_house()))
    words = ("--scene", tmp_path / "made/my.json", "--min-steps", 40, "--min-subgoals", 2)
    read_success(run_cli("generate", *words, "--seed", 1, "--out", tmp_path / "made/data"))
    shutil.move(tmp_path / "made/data", tmp_path / "data")
    shutil.rmtree(tmp_path / "made")  # the house's file is needed no more
    (path,) = (tmp_path / "data").glob("procthor-*-seed1.json")
    assert json.loads(path.read_text())["scene"]["house"] == furnished_house()

    replayed = _print("replay", path, "--out", tmp_path / "set")
    assert replayed["whole"] == replayed["trajectories"] == 1
    code, out, _ = run_cli("questions", tmp_path / "set", "--out", tmp_path / "qa.csv")
    assert code == 0 and "0 questions" not in out
    twins = _print("twins", path, "--out", tmp_path / "twins", "--kinds", "swap")
    assert twins["pairs"] > 0
    run = ("--model", "planner", "--tasks", "infthor_plans", "--data", path, "--output", tmp_path)
    code, out, err = run_cli("run", *run)
    assert code == 0 and "100.0" in out, err


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "cannot be read (No such file or directory)"),
        ("{", "not valid JSON"),
        ("[]", "has not the lists rooms, walls, objects of a house"),
        ('{"rooms": {}, "walls": [], "objects": []}', "has not the lists rooms"),
        ('{"scene": {}, "plan": {}}', "has not the lists rooms"),
    ],
)
def test_a_file_that_is_no_house_is_one_line(tmp_path, run_cli, content, message):
    path = tmp_path / "house.json"
    if content is not None:
        path.write_text(content)
    assert_refused(
        run_cli("generate", "--scene", path, "--out", tmp_path / "data"), f"{path}: {message}"
    )
    assert not (tmp_path / "data").exists()


def test_the_three_commands_make_a_set(printed, work, run_cli):
    generated, replayed, asked = printed
    assert generated["trajectories"] == 1
    assert replayed["whole"] == replayed["trajectories"] == 1
    assert replayed["actions"]["MoveAhead"]["refused"] == 0
    assert {"iou", "seconds"} <= set(replayed)

    csv = work / "set/qa_set_mine.csv"
    assert "5 questions on 1 trajectories" in asked
    assert len(read_questions(csv)) == 5
    first = csv.read_bytes()
    run_cli("questions", work / "set", "--out", csv, *_FEW)
    assert csv.read_bytes() == first


def test_what_they_print_for_people(made_folder, tmp_path, run_cli):
    out, _ = read_success(
        run_cli("replay", made_folder / "trajectories", "--out", made_folder / "set")
    )
    assert "1 trajectories on 1 floor plans (1 replayed earlier, 0 failed), 1 complete" in out
    assert "actions accepted, " in out and "MoveAhead" not in out and len(out.splitlines()) == 2
    code, out, _ = run_cli(
        "generate", "--scene", "kitchen-5", "--min-steps", 1, "--min-subgoals", 1, "--final-task",
        "--out", tmp_path,
    )  # fmt: skip
    assert code == 0
    assert "1 trajectories (0 generated earlier)" in out
    assert "objects of its final task were seen" in out and "kitchen-5-seed0" in out


def test_replay_writes_what_the_published_renderer_writes(made_folder, tmp_path, run_cli):
    size = ("--width", 64, "--height", 48)
    arguments = ("replay", made_folder / "trajectories", "--out", tmp_path, "--timeline", *size)
    assert run_cli(*arguments, "--smooth", 2)[0] == 0
    (folder,) = (path for path in tmp_path.iterdir() if path.is_dir())
    timeline = json.loads((folder / "timeline.json").read_text())
    assert (timeline["width"], timeline["height"], timeline["smooth"]) == (64, 48, 2)
    assert len(list((folder / "frames").iterdir())) == timeline["n_frames"] > timeline["n_steps"]
    (source,) = (made_folder / "trajectories").glob("*.json")
    assert timeline["source_json"] == source.name
    again = run_cli(*arguments)
    assert again[0] == 1 and "rendered with other settings" in " ".join(again[2].split())


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--smooth", 2), "--smooth: is for --timeline"),
        (("--jpeg-quality", 90), "--jpeg-quality: is for --timeline"),
        (("--keep-going",), "--keep-going: is for --timeline"),
        (("--timeline", "--frames", 2), "--frames: is for sets"),
        (("--timeline", "--quality", "Ultra"), "--quality: is Unity's"),
    ],
)
def test_options_of_the_two_forms_are_not_mixed(options, words, tmp_path, run_cli):
    assert_refused(
        run_cli("replay", "file.json", "--out", tmp_path, *options), words, after_notes=True
    )


def test_unitys_rendering_qualities_are_those_of_ai2thor():
    qualities = {name for name, number in QUALITY_SETTINGS.items() if number}
    assert set(QUALITIES) == qualities
    assert list(QUALITIES[:5]) == sorted(QUALITIES[:5], key=QUALITY_SETTINGS.get)
    settings = parse_form(
        timeline=True, frames=1, unity=True, keep_going=False, quality=None, smooth=None
    )
    assert settings.simulator_options["quality"] == "MediumCloseFitShadows"


def test_a_truncated_trajectory_is_named_and_nothing_half_written(made_folder, tmp_path, run_cli):
    source = next((made_folder / "trajectories").glob("*.json"))
    (tmp_path / "cut.json").write_bytes(source.read_bytes()[:-100])
    code, _, err = run_cli("replay", tmp_path / "cut.json", "--out", tmp_path / "set")
    assert code == 1
    assert "cut.json: not a trajectory" in err
    assert not list((tmp_path / "set/metadata").iterdir())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("replay", "nowhere.jsonl", "--out", "set"), "nowhere.jsonl"),
        (("questions", "nowhere", "--out", "qa.csv"), "has no trajectory; replay"),
        (("generate", "--scene", "nowhere-1", "--out", "out"), "unknown scene 'nowhere-1'"),
        (
            ("generate", "--scene", "kitchn-3", "--out", "out"),
            "unknown scene 'kitchn-3'; did you mean 'kitchen-3'?",
        ),
        (("generate", "--scene", "FloorPlan1", "--out", "out"), "not generated: scene FloorPlan1"),
    ],
)
def test_bad_input_is_one_line(arguments, words, tmp_path, monkeypatch, run_cli):
    monkeypatch.chdir(tmp_path)
    code, out, err = run_cli(*arguments)
    assert code in {1, 2}
    assert out == ""
    assert words in err
    assert "Traceback" not in err


def test_an_action_on_a_missing_object_is_reported_with_its_step(made_folder, tmp_path, run_cli):
    document = json.loads(next((made_folder / "trajectories").glob("*.json")).read_text())
    actions = document["plan"]["low_actions"]
    step = next(
        index for index, low in enumerate(actions) if low["api_action"]["action"] == "PickupObject"
    )
    actions[step]["api_action"]["objectId"] = "Teapot|+00.00|+01.00|+00.00"
    (tmp_path / "odd.json").write_text(json.dumps(document))
    out, _ = read_success(run_cli("replay", tmp_path / "odd.json", "--out", tmp_path / "set"))
    line = next(line for line in out.splitlines() if line.startswith("diverged: "))
    assert f"step {step}: PickupObject" in line
    assert "Teapot" in line


def test_a_scene_in_which_no_task_can_be_done_is_one_line_and_leaves_no_file(tmp_path, run_cli):
    data = tmp_path / "data"
    assert run_cli("scenes", "dump", "kitchen-5", "--embedded", "--out", data)[0] == 0
    path = data / "thor_scenes" / "objects.jsonl.gz"
    scene = json.loads(gzip.decompress(path.read_bytes()))
    bare = [item for item in scene["objects"] if not item["pickupable"]]
    path.write_bytes(
        gzip.compress(json.dumps(scene | {"scene": "FloorPlan7", "objects": bare}).encode())
    )
    for layout in (data / "alfred" / "layouts").iterdir():
        layout.rename(layout.with_name(layout.name.replace("kitchen-5", "FloorPlan7")))
    code, _, err = run_cli(
        "generate", "--scene", "FloorPlan7", "--data", data, "--out", tmp_path / "out"
    )
    assert code == 1
    (line,) = err.strip().splitlines()
    assert line.startswith(
        "not generated: scene FloorPlan7, seed 0: no further task works after 0 steps"
    )
    assert line.endswith("choose another scene or seed")
    assert not list((tmp_path / "out").iterdir())


def test_a_set_of_another_version_is_neither_continued_nor_evaluated(
    made_folder, tmp_path, run_cli
):
    shutil.copytree(made_folder / "set", tmp_path / "set")
    (tmp_path / "set/set.json").write_text('{"format": 2, "simulator": "embedded"}')
    before = sorted((tmp_path / "set").rglob("*"))
    for arguments in (
        ("replay", made_folder / "trajectories", "--out", tmp_path / "set"),
        ("questions", tmp_path / "set", "--out", tmp_path / "set/qa_set_new.csv"),
        option_words(model="oracle", tasks="nieh_gt", data=tmp_path / "set", out=tmp_path / "runs"),
    ):
        code, _, err = run_cli(*arguments)
        assert code == 2
        (line,) = err.strip().splitlines()
        assert "set.json: the set has format 2, this version reads 1" in line
    assert sorted((tmp_path / "set").rglob("*")) == before
    assert not (tmp_path / "runs").exists()


def test_bathrooms_are_left_out_of_test_sets(tmp_path, run_cli):
    ended = run_cli("generate", "--scene", "bathroom-1", "--test-set", "--out", tmp_path)
    assert_refused(ended, "bathrooms are left out", after_notes=True)
