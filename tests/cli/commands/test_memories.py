"""`check memory`, `ls memories` and `--memory` as a user types them."""

import json
from pathlib import Path

import pytest

from infthor_eval.memory import MEMORIES
from infthor_eval.storage.limits import MEMORY_SECONDS

from ...helpers.command_line import assert_refused, option_words, read_success

EXAMPLES = Path(__file__).parents[3] / "examples" / "memories"


@pytest.mark.parametrize("name", ["changes.py:Changes", "longmemeval.py:LongMemEval"])
def test_the_examples_keep_the_contract(name, run_cli):
    code, out, err = run_cli("check", "memory", EXAMPLES / name)
    assert (code, err) == (0, "")
    assert [line.split()[0] for line in out.splitlines()[:-1]] == ["holds"] * 7
    assert out.splitlines()[-1].endswith(f"{name}: keeps the contract")


def test_a_broken_memory_has_a_line_for_each_clause(tmp_path, run_cli):
    path = tmp_path / "mine.py"
    path.write_text((EXAMPLES / "changes.py").read_text().replace("order[:room]", "order"))
    code, out, _ = run_cli("check", "memory", f"{path}:Changes")
    assert code == 1
    assert "broken  budget          it recalls 2783 tokens where the budget is 0" in out
    assert out.splitlines()[-1] == f"{path}:Changes: 1 broken"


@pytest.mark.parametrize(
    ("typed", "words"),
    [
        (("check", "memory", "nothing"), "unknown memory 'nothing'"),
        (
            ("check", "memory", "last", "--memory-args", "k"),
            "--memory-args: 'k' is not of the form key=value",
        ),
        (
            ("--model", "oracle", "--tasks", "nieh_mini_memory"),
            "this task needs a memory: give --memory NAME",
        ),
        (
            ("--model", "oracle", "--tasks", "nieh_mini_gt", "--memory", "last"),
            "no task of nieh_mini_gt leaves",
        ),
        (
            option_words(model="oracle", tasks="nieh_mini_memory", memory="last", budget="0"),
            "--budget 0: give",
        ),
        (
            option_words(model="oracle", tasks="nieh_mini_memory", memory="last", retriever="x"),
            "--retriever x: no context of nieh_mini_memory retrieves frames",
        ),
    ],
)
def test_misuse_is_one_line(typed, words, tmp_path, run_cli):
    more = ("--out", tmp_path) if "--tasks" in typed else ()
    assert_refused(run_cli(*typed, *more), words, after_notes=True)


def test_all_are_listed_one_a_line_and_the_options_of_one(run_cli):
    out, _ = read_success(run_cli("ls", "memories"))
    lines = [line.split()[0] for line in out.splitlines()[3:] if line.strip()]
    assert {"last", "uniform", "clip", "notes", "text-log", "oracle", "random"} <= set(lines)
    assert set(lines) <= set(MEMORIES.names)
    code, out, _ = run_cli("ls", "memories", "notes")
    assert (code, "window=20, tokens=64" in out) == (0, True)
    code, _, err = run_cli("ls", "memories", "note")
    assert (code, "unknown memory 'note'" in err) == (2, True)


def test_a_run_for_each_memory_and_budget_with_a_table_of_all(tmp_path, run_cli):
    typed = option_words(model="qwen2.5-vl-tiny", tasks="nieh_mini_memory", limit=4, out=tmp_path)
    out, _ = read_success(run_cli(*typed, "--memory", "last,oracle", "--budget", "30,1k"))
    assert "Memories\n" in out
    folders = sorted(path.parent for path in tmp_path.rglob("results.json"))
    assert len(folders) == 4
    for folder in folders:
        document = json.loads((folder / "results.json").read_text())
        assert "took" not in document["summary"]
        memory = document["summary"]["tasks"]["nieh_mini_memory"]["memory"]
        lines = (folder / "journal" / "worker-0.jsonl").read_text().splitlines()
        units = [line for line in map(json.loads, lines) if line["type"] == "unit"]
        assert len(units) == 4
        for unit in units:
            recalled = unit["payload"]["recall"]["recalled"]
            assert all(isinstance(item, int) for item in recalled)
            assert (memory["budget"] == 1000) == (len(recalled) > 0)
    before = {
        path: path.read_bytes() for folder in folders for path in folder.rglob("results.json")
    }
    assert run_cli(*typed, "--memory", "last,oracle", "--budget", "30,1k")[0] == 0
    assert all(path.read_bytes() == content for path, content in before.items())
    read_success(run_cli("report", *folders, "--out", tmp_path / "page.html"))
    page = (tmp_path / "page.html").read_text()
    assert "nieh_mini_memory: accuracy by tokens of what a memory recalls" in page


def test_a_memory_that_fails_fails_its_questions_alone(tmp_path, run_cli):
    path = tmp_path / "mine.py"
    fails = "        if len(query.text) % 2:\n            raise KeyError('mug')\n        room ="
    path.write_text((EXAMPLES / "changes.py").read_text().replace("        room =", fails))
    typed = option_words(
        model="qwen2.5-vl-tiny", tasks="nieh_mini_memory", limit=12, out=tmp_path / "out"
    )
    _, _, err = run_cli(*typed, "--memory", f"{path}:Changes")
    (journal,) = (tmp_path / "out").rglob("worker-0.jsonl")
    units = [
        line for line in map(json.loads, journal.read_text().splitlines()) if line["type"] == "unit"
    ]
    failed = [unit for unit in units if "failure" in unit]
    assert len(units) == 12
    assert 0 < len(failed) < 12
    assert {len(unit["payload"]["question"]) % 2 for unit in failed} == {1}
    assert {unit["failure"].partition(";")[0] for unit in failed} == {
        f"the memory {path}:Changes fails (KeyError in mine.py:31 (recall): no 'mug')"
    }
    assert "Traceback" not in err


@pytest.mark.parametrize("where", ["observe", "recall"])
def test_a_memory_that_does_not_end_is_not_waited_for(tmp_path, run_cli, monkeypatch, where):
    monkeypatch.setenv(MEMORY_SECONDS.name, "1")
    path = tmp_path / "mine.py"
    path.write_text(
        "import time\n"
        "from infthor_eval.memory.frames import Last\n"
        "class Slow(Last):\n"
        f"    def {where}(self, *arguments):\n"
        "        time.sleep(600)\n"
    )
    code, out, _ = run_cli("check", "memory", f"{path}:Slow")
    assert code == 1
    assert "it is not done after 1 s" in out
