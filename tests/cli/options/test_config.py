"""`--config`: a run by a file, and the file that every run writes; models with their own
options."""

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from infthor_eval.cli.options.run import RunOptions, expand_suite_options, run_options
from infthor_eval.cli.options.values import ModelList
from infthor_eval.errors import UsageError
from infthor_eval.runs import RunRequest, Suite, read_stored_command
from tests.helpers.command_line import assert_refused, read_success
from tests.helpers.files import find_one

KEY = "sk-of-nobody-0123456789"


@pytest.fixture
def config(make_nieh_set, tmp_path):
    """Writes a file for a run of the oracle on five questions, with changes."""
    data = make_nieh_set(size=56)

    def config(**changes: object) -> Path:
        path = tmp_path / "typed.yaml"
        options = {"model": "oracle", "tasks": ["nieh_gt"], "data": str(data)}
        options |= {"out": str(tmp_path / "out"), **changes}
        path.write_text(yaml.safe_dump(options))
        return path

    return config


@pytest.mark.parametrize("words", [("run", "--config"), ("--config",)])
def test_a_run_by_a_file_and_the_command_line_overrides_it(config, tmp_path, run_cli, words):
    _, err = read_success(run_cli(*words, config(limit=2)))
    assert "oracle: 2 evaluated now" in err
    _, _, err = run_cli(*words, config(limit=2), "--limit", 3, "--model", "blind")
    assert "blind: 3 evaluated now" in err


def test_the_file_of_a_run_resumes_that_run(config, tmp_path, run_cli, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run_cli(
        "--config",
        config(data="set", out="out", limit=4, frames="blank,shown", seed=3, name="mine"),
    )
    left = sorted((tmp_path / "out" / "mine").rglob("run.yaml"))
    assert len(left) == 2
    monkeypatch.chdir("/")
    before = [(path.parent / "results.json").read_bytes() for path in left]
    for path in left:
        _, err = read_success(run_cli("--config", path))
        assert "mine: 0 evaluated now, 4 resumed" in err
    assert sorted((tmp_path / "out" / "mine").rglob("run.yaml")) == left
    assert [(path.parent / "results.json").read_bytes() for path in left] == before


def test_the_command_of_the_file_is_the_run(config, run_cli):
    run_cli("--config", config(limit=2, frames="blank"))
    folder = find_one(config().parent / "out", "run.yaml").parent
    assert "typed.yaml" not in (folder / "results.json").read_text()
    command = read_stored_command(folder)
    _, _, err = run_cli(*shlex.split(command.line)[1:])
    assert "oracle: 0 evaluated now, 2 resumed" in err


def test_several_workers_write_it_too(config, tmp_path, run_cli):
    read_success(run_cli("--config", config(workers=2)))
    assert yaml.safe_load(find_one(tmp_path / "out", "run.yaml").read_text())["workers"] == 2


def test_no_key_is_written(config, tmp_path, run_cli, monkeypatch):
    monkeypatch.setenv("OPENAI_API_KEY", KEY)
    typed = {"model": "m", "base_url": "http://localhost:9/v1", "retries": 0}
    run_cli("--config", config(model="openai", model_args=typed))
    assert find_one(tmp_path / "out", "run.yaml")
    for path in (tmp_path / "out").rglob("*"):
        assert path.is_dir() or KEY.encode() not in path.read_bytes()


BAD = {
    "limt": ({"limt": 3}, "typed.yaml: unknown option 'limt'; did you mean 'limit'?"),
    "config": ({"config": "other.yaml"}, "typed.yaml: unknown option 'config'"),
    "limit": ({"limit": 0}, "typed.yaml: limit: 0 is less than 1"),
    "seed": ({"seed": "x"}, "typed.yaml: seed: 'x' is not a valid"),
    "tasks": ({"tasks": {"a": 1}}, "typed.yaml: tasks is {'a': 1}; write one value"),
    "model_args": ({"model_args": {"a": [1]}}, "typed.yaml: model_args: a is [1]; write one value"),
    "model options": (
        {"model_args": "a"},
        "typed.yaml: model_args: --model-args: 'a' is not of the form key=value",
    ),
    "frames": ({"frames": "nothing"}, "--frames nothing: give one of shown, blank"),
    "no frames": ({"frames": ","}, "--frames is empty; give a name"),
    "unknown model option": (
        {"model": "qwen2.5-vl-tiny", "model_args": {"dtpe": "x"}},
        "did you mean dtype?",
    ),
    "choice": ({"engine": "trt"}, "typed.yaml: engine: 'trt' is not one of"),
    "flag": ({"greedy": "maybe"}, "typed.yaml: greedy: 'maybe' is not a valid boolean"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_wrong_option_in_a_file_is_named(config, tmp_path, run_cli, name):
    changes, expected = BAD[name]
    assert_refused(run_cli("--config", config(**changes)), expected)
    assert not (tmp_path / "out").exists()


def test_a_file_that_is_not_there_is_named(tmp_path, run_cli):
    assert_refused(run_cli("--config", tmp_path / "no.yaml"), "no.yaml")


@pytest.fixture
def requests():
    """What a command with the options of a run is given."""

    def requests(*arguments: object) -> list[RunRequest]:
        @click.command()
        @run_options
        def command(**options: Any) -> list[tuple[RunRequest, Suite]]:
            return RunOptions.from_click(options).requests()

        return [
            request for request, _ in command.main(list(map(str, arguments)), standalone_mode=False)
        ]

    return requests


def test_threads_are_for_models_that_compute_here(config, requests):
    file = config()
    models = "oracle,qwen2.5-vl-tiny,qwen2.5-vl-tiny:threads=3,openai:model=m"
    threads = [
        request.model_options.get("threads")
        for request in requests("--config", file, "--model", models, "--threads", 2)
    ]
    assert threads == [None, "2", "3", None]
    in_vllm = ("--model", "qwen2.5-vl", "--engine", "vllm", "--threads", 2)
    (request,) = requests("--config", file, *in_vllm)
    assert request.model_options == {"threads": "2"}
    with pytest.raises(UsageError, match="--threads 2: oracle takes no threads"):
        requests("--config", file, "--threads", 2)


def test_the_command_line_overrides_the_same_option_of_the_file(config, requests):
    file = config(model_args={"rope": "yarn:4", "dtype": "float32"}, max_cost=2)
    (request,) = requests("--config", file, "--rope", "linear:2")
    assert request.model_options == {"rope": "linear:2", "dtype": "float32", "max_cost": "2.0"}
    (request,) = requests("--config", file, "--model-args", "max_cost=5")
    assert request.model_options == {"max_cost": "5"}
    with pytest.raises(click.UsageError, match="give one of them"):
        requests("--config", config(rope="yarn:4", model_args={"rope": "yarn:2"}))


def test_each_model_has_its_own_options(config, requests):
    typed = ("--model", "qwen2.5-vl:dtype=float32,max_tokens=1000,pixtral", "--engine", "vllm")
    runs = requests("--config", config(), *typed, "--model-args", "dtype=bfloat16,seed=1")
    assert {request.model: request.model_options for request in runs} == {
        "qwen2.5-vl@vllm": {"dtype": "float32", "max_tokens": "1000", "seed": "1"},
        "pixtral@vllm": {"dtype": "bfloat16", "seed": "1"},
    }
    with pytest.raises(click.UsageError, match="max_cost counts the requests of one process"):
        requests("--config", config(workers=2), "--model", "oracle,openai:max_cost=2")


TYPED = {
    "A": [("A", {})],
    "A, B": [("A", {}), ("B", {})],
    "A:x=1,y=2,B,C:x=3": [("A", {"x": "1", "y": "2"}), ("B", {}), ("C", {"x": "3"})],
    "A:url=http://h:1/v=2,B": [("A", {"url": "http://h:1/v=2"}), ("B", {})],
    "./a.py:Class,B": [("./a.py:Class", {}), ("B", {})],
    "./a.py:Class:x=1": [("./a.py:Class", {"x": "1"})],
    "A:x=1,B:x=1,y=2,A:z=1,w=2": [
        ("A", {"x": "1"}),
        ("B", {"x": "1", "y": "2"}),
        ("A", {"z": "1", "w": "2"}),
    ],
    "A:x=1,A:x=2,A": [("A", {"x": "1"}), ("A", {"x": "2"}), ("A", {})],
    "A,B,A,A:x=1,A:x=1": [("A", {}), ("B", {}), ("A", {"x": "1"})],
}


@pytest.mark.parametrize("typed", TYPED)
def test_models_as_typed(typed):
    assert ModelList().convert(typed, None, None) == tuple(TYPED[typed])


NAMES = st.text("ab.5-", min_size=1)
OPTIONS = st.dictionaries(st.text("xy_", min_size=1), st.text("/:=1 z", min_size=1).map(str.strip))


@given(st.lists(st.tuples(NAMES, OPTIONS), min_size=1))
def test_models_as_typed_come_back(models):
    parts = [
        f"{name}:{','.join(f'{key}={value}' for key, value in options.items())}"
        if options
        else name
        for name, options in models
    ]
    expected = [model for place, model in enumerate(models) if model not in models[:place]]
    assert list(ModelList().convert(",".join(parts), None, None)) == expected


@pytest.mark.parametrize(
    ("typed", "expected"),
    [("x=1,A", "comes before any model"), (",", "--model is empty"), ("A:x=1,x=2", "given twice")],
)
def test_invalid_lists_of_models_are_refused(run_cli, typed, expected):
    assert_refused(run_cli("--model", typed, "--tasks", "nieh_gt"), expected)


def test_a_suites_option_without_a_default_must_be_given(monkeypatch: pytest.MonkeyPatch) -> None:
    @dataclass(frozen=True)
    class Required:
        size_m: int

    monkeypatch.setattr("infthor_eval.cli.options.run.options_class", lambda _: Required)
    monkeypatch.setattr("infthor_eval.cli.options.run.suite_names", lambda: ["toy"])
    assert expand_suite_options("toy", {"size_m": "3"}, ["toy"]) == [Required(3)]
    with pytest.raises(UsageError, match="--size-m: toy needs it, as its field has no default"):
        expand_suite_options("toy", {}, ["toy"])
