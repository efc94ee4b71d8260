"""What is typed, and where the output is to go: one line and exit code 2 before any work."""

import gzip
import json
import os
from pathlib import Path

import pytest

from infthor_eval.storage.files import hold_folder

from ..helpers.command_line import assert_refused, option_words

RUN = ["--model", "oracle", "--tasks", "nieh_gt", "--data", "SET"]
VIDEO = ["--model", "oracle", "--tasks", "nieh_video", "--data", "SET", "--out", "OUT"]
PUBLISHED = option_words(model="oracle", tasks="nieh_published_full", data="SET", out="OUT")
TINY = [
    *option_words(model="qwen2.5-vl-tiny", tasks="nieh_gt", data="SET", out="OUT"),
    "--model-args",
]
GENERATE = ["generate", "--scene", "kitchen-1", "--min-steps", 1]
VALIDATE = ["validate", "SET", "--model", "oracle", "--out", "OUT"]
MANIFEST = {"name": "x", "trajectories": [{"scene": "kitchen-1", "seed": 0, "min_steps": 1}]}


@pytest.fixture
def typed(make_nieh_set, tmp_path, run_cli, monkeypatch):
    """Runs a command with SET, OUT and FILE put in, in an empty folder that has a set and a
    file."""
    monkeypatch.chdir(tmp_path)
    data = make_nieh_set(size=56)
    (tmp_path / "file").write_text("of somebody's")
    (tmp_path / "manifest.json").write_text(json.dumps(MANIFEST))

    def typed(*arguments: object) -> tuple[int, str, str]:
        places = {"SET": data, "OUT": tmp_path / "out"}
        return run_cli(*(places.get(argument, argument) for argument in arguments))

    return typed


OUTPUTS = {
    "run": [*RUN, "--out"],
    "validate": ["validate", "SET", "--model", "oracle", "--out"],
    "generate": [*GENERATE, "--out"],
    "replay": ["replay", "file.json", "--out"],
    "bundle": ["bundle", "manifest.json", "--out"],
    "scenes dump": ["scenes", "dump", "kitchen-1", "--embedded", "--out"],
    "fetch": ["fetch", "nieh", "--out"],
}
PLACES = {
    "a file": ("file", "cannot be written to"),
    "below a file": ("file/below", "cannot be written to"),
    "a device": ("/dev/full", "cannot be written to"),
    "below a device": ("/dev/null/x", "cannot be written to"),
    "no file system's": ("/proc/x", "cannot be written to"),
    "a name that is too long": ("n" * 300, "cannot be written to"),
}


def _begin_work(*_: object, **__: object) -> None:
    raise AssertionError("work was begun")


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("command", OUTPUTS)
def test_a_folder_that_cannot_be_written_is_told_before_the_work(
    typed, tmp_path, monkeypatch, command, place
):
    for begins in (
        "thor.simulator.Simulator.__init__",
        "runs.work.binding._load_subject",
        "nieh.published.hub_data._download",
    ):
        monkeypatch.setattr(f"infthor_eval.{begins}", _begin_work)
    (tmp_path / "file.json").write_text("{}")
    where, expected = PLACES[place]
    assert_refused(typed(*OUTPUTS[command], where), expected)
    assert (tmp_path / "file").read_text() == "of somebody's"


MAKERS = {
    **{name: OUTPUTS[name] for name in ("generate", "replay", "bundle", "scenes dump", "fetch")},
    "twins": ["twins", "file.json", "--out"],
    "look-around": ["look-around", "empty", "--out"],
    "scenes fetch": ["scenes", "fetch", "--out"],
}


@pytest.mark.parametrize("command", MAKERS)
def test_a_folder_that_another_command_writes_is_told_before_the_work(typed, tmp_path, command):
    (tmp_path / "file.json").write_text("{}")
    (tmp_path / "empty").mkdir()
    with hold_folder(tmp_path / "out"):
        assert_refused(
            typed(*MAKERS[command], "OUT"),
            "out: another process is writing it; wait for it or stop it",
        )
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.parametrize("where", ["/dev/full", "SET", "file/below.csv", "/proc/x/y.csv"])
@pytest.mark.parametrize("command", ["questions", "scenes show"])
def test_a_file_that_cannot_be_written_is_told_before_the_work(typed, monkeypatch, command, where):
    monkeypatch.setattr("infthor_eval.thor.simulator.Simulator.__init__", _begin_work)
    arguments = ["questions", "SET"] if command == "questions" else ["scenes", "show", "kitchen-1"]
    code, _, err = typed(*arguments, "--out", where)
    assert code == 2
    assert "Traceback" not in err
    assert "give another place with --out" in err
    assert "make room" not in err
    assert Path("/dev/full").is_char_device()


TYPED = [
    ([*RUN, "--data", "SET", "--out", "OUT"], "--data is given twice; give it once"),
    (
        [*RUN, "--tasks=nieh_full", "--out", "OUT"],
        "--tasks is given twice; give it once, with commas between several values",
    ),
    (["generate", "--scene", "kitchen-1,kitchn-2", "--out", "OUT"], "unknown scene 'kitchn-2'"),
    (["generate", "--scene", ",", "--out", "OUT"], "--scene is empty; give a name"),
    ([*RUN, "--out", "OUT", "--out", "OUT"], "--out is given twice"),
    (["run", *RUN, "--out", "OUT", "--seed", "1", "--seed=2"], "--seed is given twice"),
    (["scenes", "show", "kitchen-1", "--size", "64", "--size", "65"], "--size is given twice"),
    (["questions", "SET", "--out", "a.csv", "--out", "b.csv"], "--out is given twice"),
    ([*VALIDATE, "--scorer", "strict", "--scorer", "strict"], "--scorer"),
    (["questions", "SET", "--out", "a.csv", "--min-share", "nan"], "is not a number"),
    (
        [*GENERATE, "--out", "OUT", "--count", "1000000000"],
        "set INFTHOR_EVAL_MAX_TRAJECTORIES to more than",
    ),
    ([*GENERATE, "--out", "OUT", "--count", "9" * 30], "are too many"),
    ([*GENERATE, "--out", "OUT", "--seed", "9" * 30], "--seed"),
    ([*RUN, "--out", "OUT", "--seed", "9" * 30], "--seed"),
    ([*RUN, "--out", "OUT", "--limit", "9" * 30], "--limit"),
    ([*TINY, "dtype=int8"], "dtype=int8 is not a type of weights"),
    ([*TINY, "dtype=complex64"], "dtype=complex64 is not a type of weights"),
    ([*TINY, "dtype=float8_e4m3fn"], "dtype=float8_e4m3fn is not a type of weights"),
    ([*TINY, "dtype=nn"], "dtype=nn is not a type of weights"),
    ([*TINY, "device=xpu"], "device=xpu: torch"),
    ([*TINY, "device=mps"], "device=mps: torch"),
    ([*TINY, "device=hpu"], "device=hpu: torch"),
    ([*TINY, "device=meta"], "device=meta computes nothing"),
    ([*TINY, "device=gpu"], "device=gpu is not a torch device"),
    ([*TINY, "device=cuda:99"], "device=cuda:99"),
    ([*TINY, "attn_implementation=bogus"], "attn_implementation=bogus is not known"),
    ([*TINY, "attn_implementation=kernels-community/flash-attn"], "is code on the hub"),
    ([*TINY, "attn_implementation=flash_attention_2"], "needs the package flash-attn;"),
    ([*TINY, "attn_implementation=flash_attention_3"], "needs the package flash-attn-3;"),
    ([*TINY, f"chunk_tokens={10**30}"], "chunk_tokens"),
    ([*TINY, f"batch_size={2**60}"], f"batch_size={2**60}: give a whole number"),
    ([*TINY, f"max_tokens={10**400}"], "max_tokens"),
    ([*TINY, f"feature_cache_mb={10**18}"], f"feature_cache_mb={10**18}: give a whole number"),
    ([*TINY, "min_pixels=5000,max_pixels=4000"], "min_pixels=5000 is above max_pixels=4000"),
    ([*TINY, "min_pixels=0"], "min_pixels=0: give a whole number of pixels"),
    ([*TINY, "max_pixels=-5"], "max_pixels=-5: give a whole number of pixels"),
    ([*TINY, f"min_pixels={10**12}"], f"min_pixels={10**12}: give at most"),
    ([*TINY, "min_pixels=40000000"], "min_pixels is 40000000 and max_pixels"),
    ([*VALIDATE[:-1], "SET"], "is the set itself"),
    ([*VALIDATE, "--decisions", "file"], "no column question_id"),
    (
        ["validate", "SET", "--model", "oracle,a:x=1,x=1", "--out", "OUT"],
        "--model a: 'x' is given twice",
    ),
    (
        ["train", "--recipe", "infthor_32k", "--data", "SET", "--out", "OUT", "--gpus", 4],
        "--gpus and --tflops are for --dry-run; add it",
    ),
    (
        ["train", *option_words(recipe="final_text", data="SET", out="OUT", set="prompt=plain")],
        "final_text.yaml: not a recipe (actions of the form text follow a system prompt; set "
        "prompt to chat); fix the",
    ),
    (["bundle", "file", "--out", "OUT"], "not in its documented form"),
    (
        ["validate", "nowhere", "--model", "oracle", "--out", "OUT"],
        "nowhere: no such folder; give the folder of an NIEH set, or download the published one "
        "with `infthor-eval fetch nieh`",
    ),
    (
        ["validate", ".", "--model", "oracle", "--out", "OUT"],
        "has no qa_set*.csv, as an NIEH set has beside metadata/; give the folder of an NIEH set, "
        "or download",
    ),
    (
        [*RUN, "--out", "OUT", "--prompt", "mine"],
        "'mine' is not one of 'published-main', 'published-logs'",
    ),
    (
        [*VIDEO, "--prompt", "published-logs"],
        "prompt published-logs: the context video is asked in words of its own; it is for clues, "
        "trajectory",
    ),
    (
        [*PUBLISHED, "--prompt", "published-main"],
        "no task of nieh_published_full leaves its words open; leave it out, or ask nieh_full",
    ),
]


@pytest.mark.parametrize(
    ("arguments", "expected"),
    TYPED,
    ids=[f"{n}: {expected}" for n, (_, expected) in enumerate(TYPED)],
)
def test_what_cannot_be_meant_is_refused(typed, arguments, expected):
    assert_refused(typed(*arguments), expected, after_notes=True)


@pytest.mark.parametrize("arguments", [["ls", "models"], ["ls", "tasks"], RUN, ["--version"]])
def test_a_full_disk_behind_standard_output_is_one_line(
    make_nieh_set, tmp_path, monkeypatch, capfd, arguments
):
    from infthor_eval.cli import main

    data = make_nieh_set(size=56)
    monkeypatch.chdir(tmp_path)
    with open("/dev/full", "w") as full, pytest.raises(SystemExit) as ended:  # noqa: PTH123 - a stream for sys.stdout
        monkeypatch.setattr("sys.stdout", full)
        try:
            main([str(data) if argument == "SET" else argument for argument in arguments])
        finally:
            monkeypatch.undo()
    err = capfd.readouterr().err
    assert ended.value.code == 2
    assert "cannot be read or written (No space left on device)" in err
    assert "Traceback" not in err


def test_questions_do_not_replace_what_somebody_edited(tmp_path, run_cli, monkeypatch):
    from infthor_eval.generation.questions.generate import GeneratedQuestions

    from ..conftest import QUESTIONS

    monkeypatch.setattr(
        "infthor_eval.generation.questions.generate.generate_questions",
        lambda *_, **__: GeneratedQuestions(list(QUESTIONS)),
    )
    arguments = ["questions", tmp_path, "--out", tmp_path / "qa.csv"]
    assert run_cli(*arguments)[0] == 0
    assert run_cli(*arguments)[0] == 0
    generated = (tmp_path / "qa.csv").read_bytes()
    (tmp_path / "qa.csv").write_bytes(generated.replace(b"mug", b"cup"))
    assert_refused(run_cli(*arguments), "exists already with different content")
    assert b"cup" in (tmp_path / "qa.csv").read_bytes()
    assert run_cli(*arguments, "--overwrite")[0] == 0
    assert (tmp_path / "qa.csv").read_bytes() == generated


# What a command writes, and one of the files that somebody may have edited since.
REPLACES = {
    "scenes show": (["scenes", "show", "kitchen-1", "--size", 64, "--out", "a.png"], "a.png"),
    "scenes show as JPEG": (
        ["scenes", "show", "kitchen-1", "--size", 64, "--out", "a.jpg"],
        "a.jpg",
    ),
    "scenes dump, cells": ([*OUTPUTS["scenes dump"], "d"], "d/alfred/layouts/kitchen-1-layout.npy"),
    "scenes dump, types": (
        [*OUTPUTS["scenes dump"], "d"],
        "d/alfred/layouts/kitchen-1-objects.json",
    ),
}


@pytest.mark.parametrize("name", REPLACES)
def test_a_scene_does_not_replace_what_somebody_edited(typed, tmp_path, name):
    arguments, edited = REPLACES[name]
    assert typed(*arguments)[0] == 0
    assert typed(*arguments)[0] == 0
    generated = (tmp_path / edited).read_bytes()
    (tmp_path / edited).write_text("of somebody's")
    assert_refused(
        typed(*arguments),
        f"{edited}: exists already with different content; give another --out, or --overwrite",
    )
    assert (tmp_path / edited).read_text() == "of somebody's"
    assert typed(*arguments, "--overwrite")[0] == 0
    assert (tmp_path / edited).read_bytes() == generated


def test_a_dump_does_not_replace_another_recording_of_its_scene(typed, tmp_path):
    path = tmp_path / "d" / "thor_scenes" / "objects.jsonl.gz"
    path.parent.mkdir(parents=True)
    others = '{"scene": "bedroom-1", "objects": []}\n'
    path.write_bytes(gzip.compress(f'{{"scene": "kitchen-1", "objects": []}}\n{others}'.encode()))
    arguments = [*OUTPUTS["scenes dump"], "d"]
    assert_refused(
        typed(*arguments), "has a different recording of kitchen-1 already; give another --out"
    )
    assert not (tmp_path / "d" / "alfred").exists()
    assert typed(*arguments, "--overwrite")[0] == 0
    assert gzip.decompress(path.read_bytes()).decode().startswith(others)


def test_a_run_outside_git_says_nothing_of_git(typed, capfd):
    assert typed(*RUN, "--out", "OUT")[0] == 0
    assert "git" not in capfd.readouterr().err
    assert not os.path.exists(".git")  # noqa: PTH110 - of the folder that the run was started in


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("ALL_PROXY", "socks4://127.0.0.1:1"),
        ("ALL_PROXY", "ftp://127.0.0.1"),
        ("HTTPS_PROXY", "http://a:b@:x"),
    ],
)
def test_a_proxy_that_cannot_be_used_is_one_line(typed, monkeypatch, name, value):
    monkeypatch.setenv(name, value)
    options = "model=m,base_url=https://127.1.1.1.example/v1,api_key_env=NONE"
    ended = typed(*option_words(model="openai", model_args=options, tasks="nieh_gt", data="SET"))
    line = "ALL_PROXY, HTTPS_PROXY, HTTP_PROXY or NO_PROXY cannot be used ("
    assert_refused(ended, line, after_notes=True)
    assert "name a proxy as http://HOST:PORT, or unset them" in ended[2]
