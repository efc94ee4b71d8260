"""Memories in the model's cache, as a user types them."""

import json
import shutil

import pytest

from infthor_eval.memory import MEMORIES

from ...helpers.command_line import assert_refused, option_words, read_success

CACHES = sorted(name for name in MEMORIES.built_in if name.startswith("kv-"))


def _words(out, memory, budget="27", **options):
    given = {"model": "qwen2.5-vl-nano", "tasks": "nieh_mini_twins", "context": "memory"}
    given |= {"limit": 6, "out": out, "memory": memory, **options}
    return option_words(**given, **({} if budget is None else {"budget": budget}))


def _samples(out):
    """Replies, and what was kept for each, by the run's memory."""
    found = {}
    for file in out.rglob("samples_*.jsonl"):
        run = json.loads((file.parents[2] / "results.json").read_text())
        samples = [json.loads(line) for line in file.read_text().splitlines()]
        found[run["config"]["memory"]] = [sample["resps"] for sample in samples]
    return found


def _kept(out, memory):
    for file in out.rglob("results.json"):
        run = json.loads(file.read_text())
        if run["config"]["memory"] == memory:
            return run["summary"]["tasks"]["nieh_mini_twins"]["memory"]["kept"]
    return None


def test_all_memories_of_a_command_are_cut_from_one_encoding(run_cli, tmp_path):
    memories = ("kv-window", "kv-oracle", "kv-norm", "kv-question")
    together = tmp_path / "together"
    out, err = read_success(run_cli(*_words(together, ",".join(memories))))
    read = [line for line in (out + err).splitlines() if "tokens read" in line]
    assert "(0 of them cached" in read[0]
    assert [line.split("cached, ")[1][:1] for line in read[1:]] == ["9"] * 3  # per cent
    assert "clues kept" in " ".join(out.split())
    # Each alone says the same.
    for memory in memories[1:3]:
        alone = tmp_path / memory
        read_success(run_cli(*_words(alone, memory)))
        assert _samples(alone)[memory] == _samples(together)[memory]
        assert _kept(alone, memory) == _kept(together, memory)
    kept = {memory: _kept(together, memory) for memory in memories}
    assert kept["kv-norm"]["tokens"] == 27
    assert kept["kv-oracle"]["clues"] > kept["kv-window"]["clues"]


def test_a_run_that_was_stopped_has_the_same_bytes(run_cli, tmp_path):
    words = _words(tmp_path / "whole", "kv-random")
    read_success(run_cli(*words))
    (whole,) = (tmp_path / "whole").rglob("scores.jsonl")
    shutil.copytree(tmp_path / "whole", tmp_path / "again")
    (folder,) = (file.parent for file in (tmp_path / "again").rglob("scores.jsonl"))
    (journal,) = (folder / "journal").glob("*.jsonl")
    lines = journal.read_text().splitlines(keepends=True)
    journal.write_text("".join(lines[: len(lines) // 2]))
    read_success(run_cli(*_words(tmp_path / "again", "kv-random")))
    assert (folder / "scores.jsonl").read_bytes() == whole.read_bytes()


@pytest.mark.parametrize("memory", CACHES)
def test_every_memory_of_the_cache_runs_and_says_what_it_kept(memory, run_cli, tmp_path):
    budget = None if memory == "kv-8bit" else "130"
    read_success(run_cli(*_words(tmp_path, memory, budget, model="qwen2.5-vl-tiny", limit=2)))
    kept = _kept(tmp_path, memory)
    assert kept["tokens"] > 0
    assert kept["bytes"] > 0
    assert 0 <= kept["clues"] <= 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"budget": "5"}, "--budget 5: less than a frame, which has 9 tokens; give more"),
        ({"budget": "0"}, "--budget 0: give a number of tokens from 1"),
        ({"memory": "kv-nothing"}, "unknown memory 'kv-nothing'"),
        (
            {"model": "./mine.py:answer"},
            "answer has no cache that a memory can cut; use a memory of frames",
        ),
        (
            {"model_args": "attention=sinks:0+window:9"},
            "attention=sinks:0+window:9 is none of sinks:N+window:N",
        ),
    ],
)
def test_misuse_is_one_line(words, message, run_cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text("def answer(images, text):\n    return 'yes'\n")
    given = {"memory": "kv-window", **words}
    assert_refused(run_cli(*_words(tmp_path / "out", **given)), message)


def test_agents_have_no_such_memory(run_cli, tmp_path):
    words = option_words(
        model="qwen2.5-vl-tiny", tasks="infthor_plans_mini", history="memory", memory="kv-norm"
    )
    assert_refused(
        run_cli(*words, "--out", tmp_path),
        "the memory kv-norm cuts the model's cache, for questions",
    )
