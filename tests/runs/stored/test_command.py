"""How a run was asked for, in a file of its folder that repeats it."""

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.runs import StoredCommand, TaskRequest, execute, prepare, read_stored_command
from infthor_eval.runs.stored.command import write_command
from infthor_eval.settings import Setting
from infthor_eval.workers import WorkerSettings
from tests.helpers.refusals import assert_raises_one_line
from tests.helpers.toy_suite import ToySuite
from tests.runs.toy_command import request


@dataclass(frozen=True)
class Options:
    scenes: Annotated[str | None, Setting(is_place=True)] = None
    greedy: bool = False
    history: str = "full"


def written(folder: Path, run_request: object) -> StoredCommand:
    write_command(folder, run_request)
    stored = read_stored_command(folder)
    assert stored is not None
    return stored


def test_every_run_leaves_it_and_equal_runs_leave_the_same(tmp_path: Path) -> None:
    folder = execute(prepare(request(tmp_path), ToySuite())).folder
    first = (folder / "run.yaml").read_bytes()
    execute(prepare(request(tmp_path), ToySuite()))
    assert (folder / "run.yaml").read_bytes() == first
    stored = read_stored_command(folder)
    assert stored is not None
    assert stored.options == {
        "model": "adder",
        "tasks": ["sums"],
        "seed": 0,
        "out": str(tmp_path),
    }
    assert (
        stored.line == "infthor-eval run --model adder --tasks sums --seed 0 --out "
        f"{shlex.quote(str(tmp_path))}"
    )
    assert stored.data is None


def test_options_that_are_as_by_default_are_left_out_and_places_are_found_from_anywhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("set", "plans of floors", "weights"):
        (tmp_path / name).mkdir()
    tasks = TaskRequest([], Options(scenes="plans of floors", greedy=True), Path("set"), 3, 7)
    model_options = {"pretrained": "weights", "dtype": "float32"}
    run_request = request(
        Path("out"),
        tasks=tasks,
        model="m",
        model_options=model_options,
        name="a name",
        worker_settings=WorkerSettings(workers=2),
    )
    stored = written(tmp_path, run_request)
    assert stored.options == {
        "model": "m",
        "model_args": {"pretrained": str(tmp_path / "weights"), "dtype": "float32"},
        "tasks": ["sums"],
        "data": str(tmp_path / "set"),
        "limit": 3,
        "seed": 7,
        "name": "a name",
        "out": str(tmp_path / "out"),
        "scenes": str(tmp_path / "plans of floors"),
        "greedy": True,
        "workers": 2,
    }
    assert stored.data == tmp_path / "set"
    words = shlex.split(stored.line)
    assert words[:4] == ["infthor-eval", "run", "--model", "m"]
    assert words[words.index("--scenes") + 1] == str(tmp_path / "plans of floors")
    assert words[-3:] == ["--greedy", "--workers", "2"]


def test_a_hub_id_stays_one(tmp_path: Path) -> None:
    stored = written(
        tmp_path, request(tmp_path, model_options={"pretrained": "Qwen/Qwen2.5-VL-7B-Instruct"})
    )
    assert stored.options["model_args"] == {"pretrained": "Qwen/Qwen2.5-VL-7B-Instruct"}


@given(
    st.dictionaries(st.text("ab_", min_size=1), st.text("xy ,='\"$\n#:-é", min_size=1), max_size=3)
)
def test_whatever_the_options_of_a_model_are_they_come_back(
    tmp_path_factory, options: dict[str, str]
) -> None:
    folder = tmp_path_factory.mktemp("run")
    stored = written(folder, request(folder, model_options=options))
    assert stored.options.get("model_args", {}) == options
    words = shlex.split(stored.line)
    if any("," in value for value in options.values()):  # which cannot be typed
        assert words == ["infthor-eval", "run", "--config", str(folder / "run.yaml")]
    elif options:
        assert words[words.index("--model-args") + 1] == ",".join(
            f"{key}={value}" for key, value in options.items()
        )


def test_a_run_of_an_earlier_version_has_none(tmp_path: Path) -> None:
    assert read_stored_command(tmp_path) is None


@pytest.mark.parametrize("text", ["- a\n", "1: 2\n", "", "a: [\n", "model_args: [1]\n"])
def test_a_file_without_options_is_named(tmp_path: Path, text: str) -> None:
    (tmp_path / "run.yaml").write_text(text)
    assert_raises_one_line(lambda: read_stored_command(tmp_path), str(tmp_path / "run.yaml"))


def test_the_file_is_plain_yaml(tmp_path: Path) -> None:
    write_command(tmp_path, request(tmp_path))
    assert yaml.safe_load((tmp_path / "run.yaml").read_text())["tasks"] == ["sums"]


def test_files_of_earlier_runs_call_the_folder_by_its_former_name(tmp_path: Path) -> None:
    (tmp_path / "run.yaml").write_text("model: adder\noutput: there\n")
    stored = read_stored_command(tmp_path)
    assert stored is not None
    assert stored.options == {"model": "adder", "out": "there"}
    assert stored.line == "infthor-eval run --model adder --out there"
