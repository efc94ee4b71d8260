"""The command that shows what an agent did."""

import json

import cv2
import msgspec
import pytest
from PIL import Image

from infthor_eval.plans.records import RECORDS
from infthor_eval.report.recordings.canvas import END_REPEATS, SIZE, TITLE_REPEATS
from infthor_eval.runs import read_run

from ...helpers.command_line import assert_refused, option_words, read_remarks, read_success
from ...helpers.journals import write_journal
from ...helpers.trajectories import FORK, cut_trajectory
from ...helpers.trajectories import MUG as NAME


def n_pictures(folder, *numbers):
    """Of plans by their numbers."""
    plans = {record.payload.index + 1: record.payload for record in read_run(folder, RECORDS)[1]}
    return sum(TITLE_REPEATS + len(plans[number].steps) + END_REPEATS for number in numbers)


def test_two_plans_become_an_mp4(scripted_run, scripted_data, tmp_path, run_cli):
    out = tmp_path / "new" / "watched.mp4"
    code, output, err = run_cli(
        "watch",
        scripted_run,
        *option_words(trajectory=NAME, plans="2-3", data=scripted_data, out=out),
    )
    wanted = n_pictures(scripted_run, 2, 3)
    assert (code, read_remarks(err)) == (0, [])
    assert output.splitlines() == [f"2 of 12 plans, {wanted / 2:.0f} s: {out}"]
    video = cv2.VideoCapture(str(out))
    sizes = []
    while (picture := video.read())[0]:
        sizes.append(picture[1].shape)
    assert sizes == [(SIZE[1], SIZE[0], 3)] * wanted
    assert [path.name for path in out.parent.iterdir()] == ["watched.mp4"]


def test_a_gif_is_as_long_as_its_plans(scripted_run, scripted_data, tmp_path, run_cli):
    out = tmp_path / "watched.gif"
    words = option_words(plans=2, data=scripted_data, out=out, fps=5)
    read_success(run_cli("watch", scripted_run, *words))
    with Image.open(out) as gif:
        assert gif.size == SIZE
        durations = []
        for number in range(gif.n_frames):
            gif.seek(number)
            durations.append(gif.info["duration"])
    assert sum(durations) == 200 * n_pictures(scripted_run, 2)


def test_a_file_is_named_for_what_it_shows(
    scripted_run, scripted_data, tmp_path, run_cli, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    code, output, _ = run_cli("watch", scripted_run, "--plans", "2", "--data", scripted_data)
    path = f"results/recordings/scripted-infthor_plans-{NAME}-2.mp4"
    assert (code, output.split()[-1]) == (0, path)
    assert (tmp_path / path).stat().st_size > 1000


def test_what_ends_otherwise_than_recorded_is_said_in_a_line(
    scripted_run, scripted_data, tmp_path, run_cli
):
    def change(record):
        steps = tuple(msgspec.structs.replace(step, reward=9.0) for step in record.payload.steps)
        payload = msgspec.structs.replace(record.payload, steps=steps)
        return msgspec.structs.replace(record, payload=payload)

    header, records = read_run(scripted_run, RECORDS)
    write_journal(tmp_path / "run", header, [change(record) for record in records], RECORDS)
    code, output, err = run_cli(
        "watch",
        tmp_path / "run",
        *option_words(plans=2, data=scripted_data, out=tmp_path / "a.gif"),
    )
    line = (
        "otherwise than recorded: plan 2, action 1: PickupObject Mug earns 2 now, and 9 in the run"
    )
    assert (code, read_remarks(err)) == (0, [line])
    assert "1 of 12 plans" in output


REFUSED = {
    "--trajectory hall-9": f"unknown trajectory of this run 'hall-9'; there are {NAME}",
    "--task infthor": "unknown task of this run 'infthor'; did you mean 'infthor_plans'?",
    "--plans 3-99": "--plans 3-99: the run has plans 1 to 12",
    "--plans 99": "--plans 99: the run has plans 1 to 12",
    "--plans two": "--plans 'two': is neither a plan's number nor two of them; write 7, or 3-7",
    "--out a.avi": "a.avi: unknown format; give a file name that ends in .mp4 or .gif",
    "--out b.mp4 --fps 0": "--fps",
    "--out a.mp4": "not a file; give another place with --out",
}


def test_what_cannot_be_watched_is_one_line(
    scripted_run, scripted_data, make_nieh_set, tmp_path, run_cli, evaluate, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.mp4").mkdir()
    for words, expected in REFUSED.items():
        ended = run_cli("watch", scripted_run, "--data", scripted_data, *words.split())
        assert_refused(ended, expected)
    nieh_run = evaluate(data=make_nieh_set(size=56))
    for words, expected in (
        ([scripted_run], "do not come with the package; give them as --data FILE or FOLDER"),
        ([scripted_run, "--data", "none"], "there is no such file or folder"),
        ([tmp_path], f"{tmp_path}: no journal in it; give the folder of a run"),
        (
            [nieh_run],
            f"{nieh_run}: is a run of nieh, and only runs of plans and manipulation can be watched",
        ),
    ):
        assert_refused(run_cli("watch", *words), expected)


@pytest.mark.parametrize("name", [NAME, FORK])
def test_a_trajectory_that_is_not_the_runs_is_one_line(scripted_run, tmp_path, run_cli, name):
    (tmp_path / "changed.json").write_text(json.dumps(cut_trajectory(name) | {"more": 1}))
    expected = (
        "changed since the run" if name == NAME else f"not among the trajectories of --data ({name}"
    )
    words = option_words(data=tmp_path / "changed.json", out=tmp_path / "a.gif")
    assert_refused(run_cli("watch", scripted_run, *words), NAME, expected)
    assert not (tmp_path / "a.gif").exists()
