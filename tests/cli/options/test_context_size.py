"""Contexts of a given size, extended contexts, and what is reported before the first answer."""

import json

import pytest

from infthor_eval.nieh.records import RECORDS
from infthor_eval.runs import read_run
from model_adapters.tiny.qwen2_5_vl import save_tiny_checkpoint

from ...helpers.command_line import assert_refused, option_words, read_success
from ...helpers.files import find_one
from ...helpers.journals import read_records
from ...helpers.questions import make_question

ONE = [make_question(clues=(40,))]


def line_of(text, start):
    """The one line of standard error that begins so, without the progress bars before it."""
    (line,) = (line for line in text.splitlines() if line.startswith(start))
    return line


@pytest.fixture
def short(tmp_path):
    """A tiny checkpoint that takes 1,500 tokens."""
    folder = tmp_path / "short"
    save_tiny_checkpoint(folder, seed=0)
    config = json.loads((folder / "config.json").read_text())
    config["text_config"]["max_position_embeddings"] = 1500
    (folder / "config.json").write_text(json.dumps(config))
    return folder


def n_frames(folder, task):
    samples = find_one(folder, f"samples_{task}_*.jsonl").read_text().splitlines()
    return [len(json.loads(line)["doc"]["frames"]) for line in samples]


@pytest.mark.parametrize(
    ("options", "haystack", "truncated"),
    [((), 66, 67), (("--k-tokens", 1000), 66, 66), (("--k-tokens", 1024), 67, 67)],
)
def test_a_kilo_token_has_the_default_or_the_given_value(
    make_nieh_set, tmp_path, run_cli, options, haystack, truncated
):
    data = make_nieh_set(ONE, n_frames=80, size=56)
    tasks = ["nieh_haystack_8k", "nieh_truncate_head_8k"]
    arguments = option_words(model="oracle", tasks=",".join(tasks), data=data, out=tmp_path / "out")
    read_success(run_cli(*arguments, *options))
    # A baseline is counted as Qwen2.5-VL: 121 tokens a frame.
    assert [set(n_frames(tmp_path / "out", task)) for task in tasks] == [{haystack}, {truncated}]


@pytest.mark.parametrize("model", ["oracle", "qwen2.5-vl-tiny"])
def test_the_tokens_of_a_frame_can_be_given(make_nieh_set, tmp_path, run_cli, model):
    data, out = make_nieh_set(ONE, n_frames=80, size=56), tmp_path / "out"
    tasks = ["nieh_haystack_8k", "nieh_truncate_head_8k"]
    arguments = ["--model", model, "--tasks", ",".join(tasks), "--data", data, "--out", out]
    read_success(run_cli(*arguments, "--tokens-per-frame", 390))
    assert [set(n_frames(out, task)) for task in tasks] == [{8000 // 390}, {8192 // 390}]
    (folder,) = (path.parent for path in out.rglob("journal"))
    assert read_run(folder, RECORDS)[0].config.tokens_per_frame == 390


def test_the_kilo_token_and_the_extension_are_part_of_the_run_config(
    make_nieh_set, tmp_path, run_cli
):
    data = make_nieh_set(ONE, n_frames=80, size=56)
    tasks, out = "nieh_gt,nieh_haystack_8k", tmp_path / "out"
    words = option_words(model="qwen2.5-vl-tiny", tasks=tasks, data=data, out=out)
    for options in ((), ("--k-tokens", 1024), ("--rope", "yarn:2")):
        assert run_cli(*words, *options)[0] == 0
    configs = [read_run(path.parent, RECORDS)[0].config for path in sorted(out.rglob("journal"))]
    limits = {
        (each.k_tokens, each.model["rope"]["rope_type"], each.model["max_tokens"])
        for each in configs
    }
    plain = {(None, "default", 128_000), (1024, "default", 128_000)}
    assert limits == plain | {(None, "yarn", 256_000)}


def test_the_extension_is_the_same_run_whichever_way_it_is_given(make_nieh_set, tmp_path, run_cli):
    data = make_nieh_set(size=56)
    arguments = option_words(
        model="qwen2.5-vl-tiny", tasks="nieh_gt", data=data, out=tmp_path / "out"
    )
    assert run_cli(*arguments, "--rope", "linear:2")[0] == 0
    _, _, err = run_cli(*arguments, "--model-args", "rope=linear:2")
    assert "0 evaluated now, 5 resumed from the journal" in err


def test_what_fits_only_with_rope_is_reported_with_both_limits(
    make_nieh_set, tmp_path, short, run_cli
):
    data = make_nieh_set(n_frames=20)
    arguments = option_words(
        model="qwen2.5-vl", model_args=f"pretrained={short},device=cpu", tasks="nieh"
    )
    arguments += ["--data", data, "--out", tmp_path / "out"]
    _, err = read_success(run_cli(*arguments, "--rope", "yarn:4"))
    assert line_of(err, "nieh_gt:").endswith("(limit 6,000, 1,500 before its extension): fits")
    full = line_of(err, "nieh_full:")
    assert full.endswith(": 2 of 2 contexts extended: longer than the model takes without rope")
    assert "(limit 6,000, 1,500 before its extension)" in full
    code, _, err = run_cli(*arguments)
    assert code == 1
    assert line_of(err, "nieh_full: 2 contexts").endswith(
        "(limit 1,500): 2 of 2 contexts refused: longer than the model takes"
    )


def test_an_extension_that_is_too_small_is_reported_as_refused(
    make_nieh_set, tmp_path, short, run_cli
):
    data = make_nieh_set(n_frames=20)
    arguments = option_words(
        model="qwen2.5-vl", model_args=f"pretrained={short},device=cpu", rope="linear:1.5"
    )
    code, _, err = run_cli(
        *arguments, "--tasks", "nieh_full", "--data", data, "--out", tmp_path / "out"
    )
    assert code == 1
    full = line_of(err, "nieh_full: 2 contexts")
    assert "(limit 2,250, 1,500 before its extension): 2 of 2 contexts refused" in full
    assert "extended:" not in full
    assert err.index("2 of 2 contexts refused") < err.index("evaluated now")


def test_a_context_that_is_cut_to_its_size_is_reported_as_truncated(
    make_nieh_set, tmp_path, run_cli
):
    data = make_nieh_set([*ONE, make_question("u", clues=(40,))], n_frames=80)
    for number in range(60, 80):  # one of the two trajectories is short enough
        (data / "metadata" / "u" / "img" / f"{number:09d}.png").unlink()
    metadata = data / "metadata" / "u" / "metadata.json"
    metadata.write_text(json.dumps(json.loads(metadata.read_text())[:60]))
    arguments = ["--model", "qwen2.5-vl-tiny", "--tasks", "nieh_truncate_head_8k", "--data", data]
    _, err = read_success(run_cli(*arguments, "--out", tmp_path / "out"))
    line = line_of(err, "nieh_truncate_head_8k: 2 contexts")
    assert line.endswith(
        "(limit 128,000): 1 of 2 contexts truncated: frames cut off to keep the context's size"
    )
    assert n_frames(tmp_path / "out", "nieh_truncate_head_8k") == [67, 60]


@pytest.mark.parametrize("family", ["qwen2.5-vl", "llava-onevision", "deepseek-vl", "pixtral"])
def test_the_longest_request_is_reported_as_it_is_sent(make_nieh_set, tmp_path, run_cli, family):
    data = make_nieh_set()
    arguments = option_words(
        model=f"{family}-tiny", tasks="nieh_full", data=data, out=tmp_path / "out"
    )
    _, _, err = run_cli(*arguments)
    # And the room for the reply.
    longest = max(record.tokens.context for record in read_records(tmp_path / "out")) + 50
    assert f"the longest request {longest:,} tokens" in line_of(err, "nieh_full: 2 contexts")


NO_SIZE = "no context of nieh_gt, nieh_full has a size in tokens"
BAD = {
    "oracle --rope yarn:4": "oracle has no option rope",
    "blind --rope yarn:4": "blind has no option rope",
    "qwen2.5-vl-tiny,oracle --rope yarn:4": "oracle has no option rope",
    "qwen2.5-vl-tiny --rope yarn": "rope=yarn is not TYPE:FACTOR",
    "qwen2.5-vl-tiny --rope ntk:4": "rope=ntk:4 is not TYPE:FACTOR",
    "qwen2.5-vl-tiny --rope yarn:4 --model-args rope=yarn:4": "give one of them",
    "oracle --k-tokens 1000": NO_SIZE,
    "oracle --tokens-per-frame 500": NO_SIZE,
    "oracle --tokens-per-frame 0": "--tokens-per-frame 0: give a whole number from 1",
    "oracle --tokens-per-frame -3": "--tokens-per-frame -3: give a whole number from 1",
    "oracle --tokens-per-frame few": "'few' is not a valid integer",
    "oracle --k-tokens 1001": "'1001' is not one of '1000', '1024'",
}


@pytest.mark.parametrize("typed", BAD)
def test_options_that_exclude_each_other_are_one_line(make_nieh_set, tmp_path, run_cli, typed):
    words = option_words(tasks="nieh", data=make_nieh_set(size=56), out=tmp_path / "out")
    assert_refused(run_cli("--model", *typed.split(), *words), BAD[typed])
    assert not (tmp_path / "out").exists()
