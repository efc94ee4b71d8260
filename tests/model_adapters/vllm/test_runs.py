"""Whole runs on the double, as their user types them."""

import itertools
import json
import re
import sys

import pytest

from infthor_eval.errors import UsageError
from model_adapters import name_on_engine
from tests.helpers.command_line import option_words
from tests.helpers.journals import read_outcome
from tests.helpers.trajectories import MUG, cut_trajectory, write_trajectories

from . import double


@pytest.fixture
def ask(make_nieh_set, checkpoints, tmp_path, run_cli):
    """Runs a task (`nieh_full`) on five questions about two trajectories."""
    data = make_nieh_set(size=56)

    def ask(name, *options, task="nieh_full", **model_args):
        settings = {"pretrained": checkpoints["qwen2.5-vl"], "dtype": "float32", **model_args}
        typed = ",".join(f"{option}={value}" for option, value in settings.items())
        arguments = option_words(model="qwen2.5-vl", model_args=typed, tasks=task, data=data)
        return run_cli(*arguments, "--name", name, "--out", tmp_path / "out", *options)

    return ask


def _found(folder):
    """The records of the one run in a folder, its results, and what it took."""
    (took,) = folder.rglob("usage.json")
    return *read_outcome(folder), json.loads(took.read_text())


def test_both_engines_give_the_same_replies_and_tokens_and_the_hit_rate_is_told(
    ask, vllm, tmp_path
):
    code, out, err = ask("on vllm", "--engine", "vllm")
    assert code == 0, err
    assert ask("here", "--engine", "transformers", device="cpu")[0] == 0
    (ours, results, took), (theirs, others, _) = (
        _found(tmp_path / "out" / name) for name in ("on vllm", "here")
    )
    facts = [
        [
            (one.key, one.payload.reply, one.payload.scores, one.tokens.context, one.tokens.reply)
            for one in records
        ]
        for records in (ours, theirs)
    ]
    assert facts[0] == facts[1]
    assert results["usage"] == others["usage"]
    assert results["config"]["model"]["name"] == "qwen2.5-vl@vllm"
    # Three questions on one trajectory, two on the other: all but the first of each find its
    # frames.
    warm = [record.tokens.cached > record.tokens.context / 2 for record in ours]
    assert warm == [False, True, True, False, True]
    cached = sum(record.tokens.cached for record in ours)
    assert took == {
        "requests": 5,
        "read": results["usage"]["context"],
        "cached": cached,
        "hit_rate": pytest.approx(cached / took["read"], abs=1e-6),
        "written": results["usage"]["reply"],
        "seconds": pytest.approx(sum(record.seconds for record in ours)),
        "cost": None,
    }
    assert "cached" not in results["usage"]
    assert f"({cached:,} of them cached, {100 * cached / took['read']:.1f} %)" in out


def test_the_order_of_the_requests_makes_the_hits(ask, vllm, tmp_path, monkeypatch):
    assert ask("one first", "--engine", "vllm")[0] == 0
    monkeypatch.setattr(
        "model_adapters.vllm.model.VllmModel._new_prefixes",
        lambda _, prompts: [*range(len(prompts))],
    )
    assert ask("all at once", "--engine", "vllm", "--fresh")[0] == 0
    kept, lost = (
        _found(tmp_path / "out" / name)[2]["hit_rate"] for name in ("one first", "all at once")
    )
    assert kept > 0.4
    assert lost < 0.1
    assert [len(call.prompts) for call in vllm.calls] == [1, 2, 1, 1, 3, 2]


def test_questions_on_different_frames_of_a_trajectory_are_asked_together(ask, vllm, tmp_path):
    assert ask("on vllm", "--engine", "vllm", task="nieh_gt")[0] == 0
    assert [len(call.prompts) for call in vllm.calls] == [3, 2]
    assert ask("here", "--engine", "transformers", task="nieh_gt", device="cpu")[0] == 0
    ours, theirs = (_found(tmp_path / "out" / name)[0] for name in ("on vllm", "here"))
    assert [record.payload for record in ours] == [record.payload for record in theirs]


def test_plans_are_carried_out_alike(checkpoints, vllm, task_files, tmp_path, run_cli):
    task = task_files / "plans" / "infthor_plans.yaml"
    task.write_text(
        "include: _plans.yaml\ntask: infthor_plans\ndataset_kwargs: {plans: all, max_steps: 3}\n"
    )
    data = write_trajectories(tmp_path / "data", cut_trajectory(MUG, 2))
    played = []
    for engine, more in (("vllm", ""), ("transformers", ",device=cpu")):
        model_args = f"pretrained={checkpoints['qwen2.5-vl']},dtype=float32{more}"
        arguments = option_words(
            model="qwen2.5-vl", model_args=model_args, tasks="infthor_plans", data=data
        )
        output = tmp_path / "out" / engine
        code, _, err = run_cli(*arguments, "--engine", engine, "--constrained", "--out", output)
        assert code == 0, err
        records, results = read_outcome(output)
        played.append((results["usage"], [record.payload for record in records]))
    assert played[0] == played[1]
    assert all(call.params.structured_outputs is not None for call in vllm.calls)


def test_switches_that_change_no_reply_are_checked_and_the_run_follows(ask, vllm, tmp_path):
    switches = {"block_size": 32, "max_num_batched_tokens": 256, "prefix_caching": "true"}
    code, _, err = ask("on vllm", "--engine", "vllm", "--check-equality", 3, **switches)
    assert code == 0, err
    typed = "max_num_batched_tokens=256,block_size=32"
    assert f"on vllm: 3 replies are equal with and without {typed}" in " ".join(err.split())
    switched, plain, run = vllm.started
    assert switched == run
    assert plain == {name: value for name, value in run.items() if name not in switches}
    assert len(_found(tmp_path / "out" / "on vllm")[0]) == 5


def test_a_cache_type_that_changes_replies_is_named_and_the_run_is_not_started(ask, vllm, tmp_path):
    fp8 = {"block_size": 32, "kv_cache_dtype": "fp8"}
    code, out, err = ask("on vllm", "--engine", "vllm", "--check-equality", 5, **fp8)
    assert (code, out) == (1, "")
    line = " ".join(err.split())
    found = re.search(r"(\d) of 5 replies differ with block_size=32,kv_cache_dtype=fp8", line)
    assert found is not None and int(found[1]) > 0
    assert f"(block_size=32 alone: 0, kv_cache_dtype=fp8 alone: {found[1]}); not started" in line
    assert not (tmp_path / "out" / "on vllm").exists()


def test_an_engine_that_differs_from_itself_is_said_to(ask, vllm, monkeypatch):
    ids = itertools.count(30)
    monkeypatch.setattr(double._Vlm, "write", lambda *_: ([next(ids)], ""))
    code, _, err = ask("on vllm", "--engine", "vllm", "--check-equality", 2, block_size=32)
    assert code == 1
    line = "2 of 2 replies differ with block_size=32 (without it, asked again: 2); not started"
    assert line in " ".join(err.split())


def test_transformers_switches_are_checked_as_well(ask):
    small = {"device": "cpu", "chunk_tokens": 64, "batch_size": 1}
    code, _, err = ask("here", "--check-equality", 2, **small)
    assert code == 0, err
    assert "2 replies are equal with and without chunk_tokens=64,batch_size=1" in " ".join(
        err.split()
    )


@pytest.mark.parametrize(
    ("model", "expected"),
    [
        ("qwen2.5-vl@vllm", "its switches are max_num_seqs, max_num_batched_tokens, "),
        ("qwen2.5-vl-nano", "its switches are attn_implementation, share_prefix, "),
        ("oracle", "it has none"),
    ],
)
def test_without_a_switch_there_is_nothing_to_compare(run_cli, model, expected):
    code, _, err = run_cli("--model", model, "--tasks", "nieh_mini", "--check-equality", 3)
    assert code == 2
    assert f"--check-equality 3: --model-args turns no switch of {model} on" in err
    assert expected in err


def test_engines_that_do_not_run_a_model_are_refused_in_one_line(run_cli, tmp_path):
    known = "these do: hf-lm, hf-vlm, llava-onevision, openvla, pixtral, qwen2.5-vl"
    for command in ("run", "plan"):
        code, _, err = run_cli(
            command, "--model", "deepseek-vl", "--engine", "vllm", "--tasks", "nieh_mini"
        )
        assert code == 2
        assert f"deepseek-vl does not run on vllm; {known}" in err
        assert "Traceback" not in err


def test_the_name_of_a_model_may_say_its_engine():
    assert (
        name_on_engine("qwen2.5-vl", "vllm")
        == name_on_engine("qwen2.5-vl@vllm", "vllm")
        == "qwen2.5-vl@vllm"
    )
    assert name_on_engine("deepseek-vl", "transformers") == "deepseek-vl"
    with pytest.raises(
        UsageError, match="pixtral@vllm names its engine, and it is not transformers; leave one"
    ):
        name_on_engine("pixtral@vllm", "transformers")


def test_a_run_without_vllm_ends_with_one_line(ask, monkeypatch):
    monkeypatch.setitem(sys.modules, "vllm", None)
    code, _, err = ask("none", "--engine", "vllm")
    assert code == 2
    assert "pip install 'infthor-eval[vllm]'" in err
    assert "Traceback" not in err
