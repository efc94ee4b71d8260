"""The command that shows what an arm did, on a run of the embedded simulator."""

import cv2
import msgspec
import pytest
from PIL import Image

from infthor_eval.cli import main
from infthor_eval.manipulation.records import RECORDS
from infthor_eval.report.recordings.canvas import END_REPEATS, SIZE, TITLE_REPEATS
from infthor_eval.runs import read_run

from ...helpers.command_line import assert_refused, option_words, read_remarks
from ...helpers.journals import write_journal


@pytest.fixture(scope="module")
def arm_run(tmp_path_factory):
    """Two pick-ups and two puts of one trajectory, by an arm that moves at random: in deltas, as
    policies do."""
    output = tmp_path_factory.mktemp("arms")
    words = option_words(model="random-arm", tasks="manipulathor_mini", limit=2, out=output)
    with pytest.MonkeyPatch.context() as patched, pytest.raises(SystemExit) as ended:
        # The first ones, which are of one trajectory; a limit takes them from all.
        patched.setattr(
            "infthor_eval.manipulation.task.limit_items", lambda episodes, *_: episodes[:2]
        )
        main([str(word) for word in words])
    assert ended.value.code == 0
    (folder,) = (output / "random-arm").iterdir()
    return folder


@pytest.fixture(scope="module")
def episodes(arm_run):
    return sorted(
        (record.payload for record in read_run(arm_run, RECORDS)[1]),
        key=lambda payload: payload.index,
    )


@pytest.fixture(scope="module")
def trajectory(arm_run):
    (name,) = {record.cluster for record in read_run(arm_run, RECORDS)[1]}
    return name


def rewritten(folder, place, change):
    header, records = read_run(folder, RECORDS)
    return write_journal(place, header, [change(record) for record in records], RECORDS)


def test_episodes_become_an_mp4_and_go_as_they_were_recorded(
    arm_run, episodes, trajectory, tmp_path, run_cli
):
    out = tmp_path / "new" / "watched.mp4"
    chosen = [episodes[0], next(payload for payload in episodes if payload.kind == "put")]
    numbers = ",".join(str(payload.index) for payload in chosen)
    code, output, err = run_cli(
        "watch", arm_run, "--trajectory", trajectory, "--episode", numbers, "--out", out
    )
    wanted = sum(TITLE_REPEATS + len(payload.steps) + END_REPEATS for payload in chosen)
    assert (code, read_remarks(err)) == (0, [])
    assert output.splitlines() == [f"2 of 4 episodes, {wanted / 2:.0f} s: {out}"]
    video, sizes = cv2.VideoCapture(str(out)), []
    while (picture := video.read())[0]:
        sizes.append(picture[1].shape)
    assert sizes == [(SIZE[1], SIZE[0], 3)] * wanted


def test_a_sheet_shows_all_episodes(arm_run, tmp_path, run_cli):
    out = tmp_path / "sheet.png"
    code, output, err = run_cli("watch", arm_run, "--sheet", out)
    assert (code, read_remarks(err), output.splitlines()) == (0, [], [f"4 of 4 episodes: {out}"])
    with Image.open(out) as sheet:
        assert sheet.size[1] > 4 * 300
        assert len(sheet.convert("RGB").getcolors(1 << 24)) > 1000


def test_what_goes_otherwise_than_recorded_is_said_in_a_line(arm_run, episodes, tmp_path, run_cli):
    def moved(record):
        steps = tuple(
            msgspec.structs.replace(step, hand=(step.hand[0], step.hand[1] + 0.1, step.hand[2]))
            for step in record.payload.steps
        )
        return msgspec.structs.replace(
            record, payload=msgspec.structs.replace(record.payload, steps=steps)
        )

    folder = rewritten(arm_run, tmp_path / "run", moved)
    first = episodes[0].index
    code, _, err = run_cli("watch", folder, "--episode", first, "--out", tmp_path / "a.gif")
    line = (
        f"otherwise than recorded: action {first}, step 1: the hand is 10 cm from where it was in "
        "the run"
    )
    assert (code, read_remarks(err)) == (0, [line])


def test_episodes_in_which_nobody_acted_have_the_title_alone(arm_run, episodes, tmp_path, run_cli):
    def failed(record):
        fresh = msgspec.structs.replace(record.payload, steps=(), ended="", reward=0.0)
        return msgspec.structs.replace(record, payload=fresh, failure="out of memory")

    folder = rewritten(arm_run, tmp_path / "run", failed)
    code, output, _ = run_cli(
        "watch", folder, "--episode", episodes[0].index, "--out", tmp_path / "a.gif", "--fps", 1
    )
    assert (code, output.splitlines()) == (
        0,
        [f"1 of 4 episodes, {TITLE_REPEATS} s: {tmp_path / 'a.gif'}"],
    )
    assert run_cli("watch", folder, "--sheet", tmp_path / "sheet.png")[0] == 0


def test_what_cannot_be_watched_is_one_line(
    arm_run, episodes, trajectory, scripted_run, tmp_path, run_cli, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    of_plans = f"is not for runs of manipulation, and {arm_run} is one; leave it out"
    there = ", ".join(str(payload.index) for payload in episodes)
    refused = {
        "--trajectory hall-9": f"unknown trajectory of this run 'hall-9'; there are {trajectory}",
        "--task nothing": "unknown task of this run 'nothing'",
        "--episode 1": f"--episode 1: the run has episodes {there} of {trajectory}",
        "--episode one": "--episode 'one': is no number of an action; write 17, or 17,75",
        "--plans 1": f"--plans: {of_plans}",
        "--sheet a.jpg": "a.jpg: a sheet is a PNG",
        "--sheet a.png --out a.gif": "--sheet and --out: one picture or",
        "--data none": "there is no such file or folder",
    }
    for words, expected in refused.items():
        assert_refused(run_cli("watch", arm_run, *words.split()), expected)
    for option, value in (("--episode", 1), ("--sheet", "a.png")):
        ended = run_cli("watch", scripted_run, option, value)
        assert_refused(ended, f"{option}: is not for runs of plans")
