"""The figures that no change may move unseen: what is measured, what counts as moved, and how a
change is committed."""

import json
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from ..helpers.benchmarks import FOLDER, load_benchmark

VITALS = load_benchmark("vitals")
PRINTS = 'import json; print(json.dumps({"a": {"b": [3, 4.5]}, "yes": True}))'


def figure(**fields):
    return {"name": "a figure", "path": "a.b.1", "aim": 5, "noise": 0.2, "value": 4.5, **fields}


def vitals(tmp_path: Path, *words: str, command=("python", "-c", PRINTS), **fields):
    """Run the script on one figure; returns its exit code, what it printed, and the figure as the
    file has it then."""
    file = tmp_path / "vitals.json"
    if not file.exists():
        file.write_text(json.dumps([{"command": list(command), "figures": [figure(**fields)]}]))
    done = subprocess.run(
        [sys.executable, FOLDER / "vitals.py", "--file", file, *words],
        capture_output=True,
        text=True,
        check=False,
    )
    assert not done.stderr
    return done.returncode, done.stdout, json.loads(file.read_text())[0]["figures"][0]


@pytest.mark.parametrize(
    ("value", "moved"), [(4.5, False), (4.7, False), (4.3, False), (4.71, True), (4.2, True)]
)
def test_what_is_within_the_noise_has_not_moved(tmp_path, value, moved):
    code, output, _ = vitals(tmp_path, value=value)
    assert (code, "MOVED" in output) == ((1, True) if moved else (0, False))


def test_what_was_never_measured_is_new_and_is_to_be_committed(tmp_path):
    code, output, _ = vitals(tmp_path, value=None)
    assert code == 1
    assert "new" in output


def test_a_move_is_committed_with_its_reason_and_has_then_not_moved(tmp_path):
    code, _, after = vitals(tmp_path, "--commit", "the lamp stands elsewhere", value=7.0)
    assert code == 0
    assert (after["value"], after["why"]) == (4.5, "the lamp stands elsewhere")
    assert after["commit"] and after["date"]
    assert vitals(tmp_path)[0] == 0


def test_a_value_that_has_not_moved_is_left_as_it_is(tmp_path):
    _, _, after = vitals(tmp_path, "--commit", "why not", value=4.6)
    assert after == figure(value=4.6)


@pytest.mark.parametrize(
    ("command", "path", "expected"),
    [
        (("python", "-c", "raise SystemExit('no room')"), "a", "failed with 1: no room"),
        (("python", "-c", "print('text')"), "a", "failed with 0"),
        (("python", "-c", PRINTS), "a.c", "no number at a.c"),
        (("python", "-c", PRINTS), "a.b.7", "no number at a.b.7"),
    ],
)
def test_what_cannot_be_measured_is_said_and_fails(tmp_path, command, path, expected):
    code, output, _ = vitals(tmp_path, command=command, path=path)
    assert code == 1
    assert expected in output


def test_what_needs_recorded_data_is_left_out_without_it(tmp_path):
    command = ("python", "-c", PRINTS, "{data}")
    code, output, _ = vitals(tmp_path, command=command, value=1.0)
    assert code == 0
    assert "left out: needs --data" in output
    assert vitals(tmp_path, "--data", str(tmp_path))[0] == 1  # it was measured now


def test_numbers_are_found_by_their_path():
    document = json.loads('{"a": {"b": [3, 4.5]}, "x / y": 1, "yes": true}')
    assert VITALS.number_at(document, "a.b.0") == 3
    assert VITALS.number_at(document, "yes") == 1
    assert VITALS.number_at(document, "a.b.1 / a.b.0") == 1.5


def test_each_committed_figure_has_a_value_an_aim_and_a_script():
    measurements = msgspec.json.decode(
        (FOLDER / "vitals.json").read_bytes(), type=list[VITALS.Measurement]
    )
    names = [figure.name for measurement in measurements for figure in measurement.figures]
    assert len(names) == len(set(names))
    for measurement in measurements:
        if measurement.command[0] == "python":
            assert (FOLDER.parent / measurement.command[1]).is_file()
        for figure in measurement.figures:
            assert figure.value is not None and figure.commit and figure.date and figure.why
