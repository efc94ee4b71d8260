import json
import os
import signal

import pytest

from infthor_eval.formats.question import Question
from infthor_eval.suites import baseline_suites
from model_adapters import names, options_of
from model_adapters.options import shown_default

from ...helpers.command_line import assert_refused, option_words, read_success
from ...helpers.files import find_one
from ...helpers.journals import count_records
from ...helpers.printed import read_rows
from ...helpers.processes import finish, start_cli
from ...helpers.questions import make_question
from ...helpers.waiting import wait_until

MANY = [
    Question(traj_id, f"Is there a {name}?", (index,), ("yes",), "object_presence")
    for traj_id in ("traj_a", "traj_b")
    for index, name in enumerate(("mug", "plate", "sink", "fridge", "apple", "bread"))
]


# By clues, total, interval, bootstrap, open-ended, absence, samples, skipped, failed. Two
# trajectories tell little, also where all is right: Wilson's interval on 2 questions. A bootstrap
# of equal scores tells nothing.
FULL_MARKS = [
    *("100.00", "(3)", "100.00", "(1)", "100.00", "(1)", "100.00", "34.2–100.0", "-"),
    *("100.00", "(2)", "-", "100.0", "5", "0", "0", "0"),
]


def test_the_table_shows_every_model_task_and_scorer_beside_the_published_rows(
    make_nieh_set, tmp_path, run_cli
):
    data = make_nieh_set(size=56)
    arguments = option_words(model="oracle,blind", tasks="nieh", data=data, out=tmp_path / "out")
    out, _ = read_success(run_cli(*arguments, "--full"))
    rows = [line.split() for line in out.splitlines()]
    assert ["oracle", "nieh_gt", "strict", *FULL_MARKS] in rows
    assert ["oracle", "nieh_full", "reference", *FULL_MARKS] in rows
    assert any(row[:2] == ["blind", "nieh_gt"] for row in rows)
    assert "Qwen2.5-VL 7B" in out
    assert "82.20" in out
    for model in ("oracle", "blind"):
        results = json.loads(find_one(tmp_path / "out" / model, "results.json").read_text())
        assert results["summary"]["tasks"]["nieh_gt"]["by_clues"]["total"]["n"] == 5


def test_frames_of_the_embedded_simulator_are_labelled(make_nieh_set, tmp_path, run_cli):
    data = make_nieh_set(size=56)
    (data / "set.json").write_text('{"simulator": "embedded"}')
    _, out, _ = run_cli(
        "run", *option_words(model="oracle", tasks="nieh_gt", data=data, out=tmp_path / "out")
    )
    assert "embedded simulator: not comparable" in " ".join(out.split())


def test_the_haystack_is_shown_by_depth_and_counts_what_does_not_fit(
    make_nieh_set, tmp_path, run_cli
):
    data = make_nieh_set([make_question(clues=(70,))], n_frames=140, size=56)
    words = option_words(
        model="oracle", tasks="nieh_haystack_8k,nieh_haystack_1m", data=data, out=tmp_path / "out"
    )
    out, err = read_success(run_cli(*words))
    assert "nieh_haystack_1m: 5 sample(s) skipped: the window reaches outside the trajectory" in err
    assert not any(row.startswith("oracle nieh_haystack_1m") for row in read_rows(out))
    assert "nieh_haystack_1m: nothing asked, 5 skipped: the window reaches outside" in " ".join(
        out.split()
    )
    rows = read_rows(run_cli(*words, "--full")[1])
    # 8,000 // 121 = 66 frames: from frame 70, 57, 44, 31, 18; all inside 140 frames.
    assert "oracle nieh_haystack_8k strict" + " 100.00 (1)" * 5 in rows
    row = next(row for row in rows if row.startswith("oracle nieh_haystack_1m strict "))
    assert row.endswith(" 0 5 0 0")


def test_the_metrics_of_a_task_file_are_shown_beside_the_published_ones(
    make_nieh_set, tmp_path, run_cli, task_files
):
    (task_files / "nieh" / "own.py").write_text(
        "def measure(doc, results):\n    return {'letters': len(results[0]) / 20}\n"
    )
    (task_files / "nieh" / "nieh_own.yaml").write_text(
        "include: _nieh.yaml\ntask: nieh_own\ndataset_kwargs: {context: clues}\n"
        "process_results: !function own.measure\nmetric_list: [{metric: letters}]\n"
    )
    arguments = option_words(model="oracle", data=make_nieh_set(size=56), out=tmp_path / "out")
    out, _ = read_success(run_cli(*arguments, "--tasks", "nieh_gt,nieh_own", "--full"))
    rows = [line.split() for line in out.splitlines()]
    own = next(row for row in rows if row[:2] == ["oracle", "nieh_own"] and len(row) > 7)
    # By clues: 3, 2 and 2 letters of 20; 10; 10.
    assert (own[2], own[3:10:2]) == ("letters", ["11.67", "50.00", "50.00", "27.00"])
    assert ["oracle", "nieh_gt", "strict", *FULL_MARKS] in rows
    samples = find_one(tmp_path / "out", "samples_nieh_own_*.jsonl").read_text().splitlines()
    assert [json.loads(line)["letters"] for line in samples] == [0.15, 0.5, 0.5, 0.1, 0.1]


@pytest.mark.parametrize("repeats", [1, 3])
def test_a_killed_run_resumes_and_ends_as_an_undisturbed_one(make_nieh_set, tmp_path, repeats):
    data = make_nieh_set(MANY)
    n_answers = 2 * repeats * len(MANY)

    def start(output):
        arguments = option_words(model="qwen2.5-vl-tiny", tasks="nieh", data=data, out=output)
        arguments += ["--repeats", repeats]
        return start_cli(*arguments)

    killed = start(tmp_path / "killed")
    wait_until(lambda: count_records(tmp_path / "killed") >= 3, killed)  # some answers, not all
    os.kill(killed.pid, signal.SIGKILL)
    killed.communicate()
    n_before = count_records(tmp_path / "killed")
    assert 0 < n_before < n_answers

    notes = finish(start(tmp_path / "killed"))
    assert f"{n_answers - n_before} evaluated now, {n_before} resumed" in notes
    finish(start(tmp_path / "whole"))

    results = [find_one(tmp_path / name, "results.json") for name in ("killed", "whole")]
    assert results[0].read_bytes() == results[1].read_bytes()
    for task in ("nieh_gt", "nieh_full"):
        samples = [
            find_one(tmp_path / name, f"samples_{task}_*.jsonl") for name in ("killed", "whole")
        ]
        assert samples[0].read_bytes() == samples[1].read_bytes()


RUN = ["--model", "oracle", "--tasks", "nieh", "--data", "SET"]
BAD = [
    (["--model", "orcle", "--tasks", "nieh", "--data", "SET"], "did you mean 'oracle'?"),
    (
        ["--model", "planner", "--tasks", "nieh_mini"],
        "a baseline of plans, and nieh_mini_gt is a task of nieh",
    ),
    (["--model", "oracle", "--tasks", "nieh_ful", "--data", "SET"], "did you mean 'nieh_full'?"),
    (RUN[:4], "give its folder with --data"),
    ([*RUN[:4], "--data", "nowhere"], "nowhere: no such folder"),
    (["--model", "oracle", "--tasks", ",", "--data", "SET"], "--tasks is empty"),
    (RUN[:2], "Missing option '--tasks'; see `infthor-eval run --help`"),
    ([*RUN, "--model-args", "a"], "not of the form key=value"),
    (
        [*RUN, "--model-args", "a=1"],
        "oracle has no option a, nor any other; of several models, MODEL:a=VALUE in --model gives",
    ),
    (
        option_words(model="qwen2.5-vl-tiny", tasks="nieh", data="SET", model_args="dtpe=x"),
        "mean dtype?",
    ),
    ([*RUN, "--limit", "0"], "'--limit': 0 is less than 1"),
    ([*RUN, "--limit", str(2**63)], "is more than"),
    ([*RUN, "--limit", "x"], "'x'"),
    (["--modle", "oracle"], "unknown option --modle; did you mean --model?"),
    (["--model", "oracle", "--taks", "nieh"], "unknown option --taks; did you mean --tasks?"),
    (["--zzz", "oracle"], "unknown option --zzz; see `infthor-eval run --help`"),
    (["compair", "a", "b"], "unknown command 'compair'; did you mean 'compare'?"),
    (["xyz"], "unknown command 'xyz'; there are audit, "),
    (["ls", "modles"], "Did you mean 'models'?"),
]


@pytest.mark.parametrize(("arguments", "expected"), BAD, ids=[expected for _, expected in BAD])
def test_misuse_ends_in_one_line_and_exit_code_2(
    make_nieh_set, tmp_path, run_cli, arguments, expected
):
    data = make_nieh_set(size=56)
    arguments = [str(data) if argument == "SET" else argument for argument in arguments]
    assert_refused(
        run_cli(*arguments, *(["--out", tmp_path / "out"] if "--model" in arguments else [])),
        expected,
    )
    assert not (tmp_path / "out").exists()


def test_bad_data_ends_in_one_line_and_exit_code_2(make_nieh_set, tmp_path, run_cli):
    data = make_nieh_set(size=56)
    for traj_id in ("traj_a", "traj_b"):
        (data / "metadata" / traj_id / "img" / "extra.png").write_bytes(b"")
    assert_refused(
        run_cli("--model", "oracle", "--tasks", "nieh", "--data", data, "--out", tmp_path / "out"),
        "trajectory traj_a: 7 frames but 6 entries",
    )


def test_ls_lists_models_one_a_line_with_engine_and_usual_checkpoint(run_cli):
    rows = [line.split() for line in run_cli("ls", "models")[1].splitlines()[3:] if line.strip()]
    assert [row[0] for row in rows] == [*baseline_suites(), *names()]
    by_name = {row[0]: row[1:] for row in rows}
    assert [name for name, (*what, _engine) in by_name.items() if not what] == []  # says what it is
    assert by_name["random"] == ["a", "baseline", "of", "nieh,", "plans", "-"]
    assert by_name["qwen2.5-vl"] == ["usually", "Qwen/Qwen2.5-VL-7B-Instruct", "transformers"]
    assert (by_name["qwen2.5-vl@vllm"][-1], by_name["openai"][-1]) == ("vllm", "-")


def test_ls_prints_the_options_of_a_model(run_cli):
    printed = " ".join(run_cli("ls", "models", "qwen2.5-vl-tiny")[1].split())
    assert "random weights" in printed
    for name, declared in options_of("qwen2.5-vl-tiny").items():
        assert f"{name} {shown_default(declared)} {declared.about}" in printed
        assert declared.setting.help.endswith(".")
    assert "a baseline of nieh; no options" in run_cli("ls", "models", "blind")[1]
    code, _, err = run_cli("ls", "models", "blnd")
    assert code == 2
    assert err == "infthor-eval: unknown model 'blnd'; did you mean 'blind'?\n"


def test_ls_lists_tasks_and_joins_those_that_differ_in_size(run_cli):
    printed = " ".join(run_cli("ls", "tasks")[1].split())
    assert "nieh_mini_gt " in printed
    assert "nieh_haystack_{8k,...,1m} A window of {8K,...,1M} tokens, with" in printed
    assert "group: nieh_haystack_{8k,16k,32k,64k,128k,256k,512k,1m}" in printed
    assert "nieh_published_last_{32k,64k} " in printed


def test_ls_lists_a_users_own_tasks(run_cli, tmp_path):
    (tmp_path / "mine.yaml").write_text(
        "include: _nieh.yaml\ntask: my_own_task\ndataset_kwargs: {context: clues}\n"
    )
    assert "my_own_task" not in run_cli("ls", "tasks")[1]
    assert "my_own_task" in run_cli("ls", "tasks", "--include-path", tmp_path)[1]


def test_help_of_a_run_has_each_option_once(run_cli):
    help_text = " ".join(run_cli("run", "--help")[1].split())
    assert help_text.count("or the path of a Unity executable") == 1
    assert "[manipulation, plans]" in help_text
    assert "9223372036854775807" not in help_text
