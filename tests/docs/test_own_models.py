"""docs/own-models.md agrees with the code, and its adapter works."""

import dataclasses
import json
import re
import traceback

import pytest

from infthor_eval.errors import ModelError
from infthor_eval.formats.frames import FrameRef
from model_adapters import (
    Capabilities,
    Decoding,
    adapter_identity,
    label,
    load,
    wrap_request_errors,
)
from model_adapters.check.clauses import start_conversation
from model_adapters.check.contract import model_checks, policy_checks
from tests.model_adapters.check.test_policy import Scripted

from .blocks import ROOT, written_files

NAME = "./my_adapter.py:Brightness"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    written_files("docs/own-models.md", tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def rows(heading):
    """The words in the first column of the first table below a heading."""
    page = (ROOT / "docs/own-models.md").read_text().partition(f"## {heading}\n")[2]
    table = re.search(r"\n\|---.*?\n\n", page, re.DOTALL).group()
    return [
        word
        for row in table.splitlines()
        for word in re.findall(r"`(\w+)`", row.split("|")[1] if row else "")
    ]


def test_the_pages_adapter_keeps_the_contract(folder, run_cli):
    code, out, err = run_cli("check", "adapter", NAME)
    assert (code, err) == (0, "")
    assert out.splitlines()[-1] == f"{NAME}: keeps the contract"
    assert [line.split()[0] for line in out.splitlines()[:-1]] == ["holds"] * 14


def test_it_is_evaluated_and_a_run_of_its_own_when_it_is_edited(folder, run_cli):
    typed = ("--model", NAME, "--tasks", "nieh_mini_gt", "--limit", 5)
    assert run_cli(*typed)[0] == 0
    source = folder / "my_adapter.py"
    source.write_text(source.read_text().replace('"yes" if', '"maybe" if'))
    assert run_cli(*typed)[0] == 0
    assert len(list((folder / "results" / "Brightness").iterdir())) == 2
    identities = [json.loads(path.read_text())["config"] for path in folder.rglob("results.json")]
    assert {identity["adapter"]["file"] for identity in identities} == {"my_adapter.py"}
    assert {identity["model"]["name"] for identity in identities} == {"Brightness"}


def test_workers_find_it(folder, run_cli):
    code, _, err = run_cli("--model", NAME, "--tasks", "nieh_mini_gt", "--limit", 3, "--workers", 2)
    assert code == 0, err


def test_the_table_of_checks_has_all_of_them():
    frames = (FrameRef("black"), FrameRef("white"))
    assert rows("What is checked") == list(model_checks(None, *frames))
    policy = policy_checks(Scripted(), *frames)
    assert (
        f"has {', '.join(f'`{name}`' for name in policy)}".replace(
            ", `episodes`", " and `episodes`"
        )
        in (ROOT / "docs/own-models.md").read_text()
    )


def test_the_table_of_capabilities_has_all_of_them_with_their_defaults():
    page = (ROOT / "docs/own-models.md").read_text()
    assert rows("What it supports") == [item.name for item in dataclasses.fields(Capabilities)]
    for item in dataclasses.fields(Capabilities):
        assert f"| `{item.name}` | `{item.default}` |" in page


@pytest.mark.parametrize(
    ("source", "name", "said"),
    [
        ("", "./none.py:A", "there is no such file"),
        ("A = 1", "./own.py:B", "has no class B"),
        ("A = 1", "./own.py:A", "has no Options and build"),
        (
            "import nothing_of_this_name",
            "./own.py:A",
            "(ModuleNotFoundError in own.py:1 (<module>)",
        ),
        (
            "def f(:",
            "./own.py:A",
            "is imported (SyntaxError in own.py:1: invalid syntax)",
        ),
    ],
)
@pytest.mark.parametrize("command", [("check", "adapter"), ("--tasks", "nieh_mini_gt", "--model")])
def test_a_file_that_is_no_adapter_is_refused_in_one_line(
    tmp_path, run_cli, monkeypatch, command, source, name, said
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.py").write_text(source)
    code, _, err = run_cli(*command, name)
    assert (code, len(err.splitlines())) == (2, 1), err
    assert said in err
    assert "Traceback" not in err


def test_a_broken_clause_and_an_exception_are_reported_with_the_others(folder, run_cli):
    source = folder / "my_adapter.py"
    source.write_text(
        source.read_text()
        .replace("return Reply(text if", "return Reply('same' if")
        .replace('question = "".join(', 'question = None + "".join(')
    )
    code, out, err = run_cli("check", "adapter", NAME)
    assert (code, err) == (1, "")
    clauses = {
        line.split()[1]: line for line in out.splitlines() if line.startswith(("holds", "broken"))
    }
    assert len(clauses) == 14
    assert clauses["members"].startswith("holds")
    assert "it raises TypeError in my_adapter.py:" in clauses["reply"]
    assert out.splitlines()[-1].endswith("broken")
    source.write_text(source.read_text().replace("def close", "def shut"))
    code, out, err = run_cli("check", "adapter", NAME)
    assert (code, out.splitlines()[0]) == (
        1,
        "broken  members         Brightness lacks a member of Model: close",
    )


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (("def close", "def shut"), "Brightness lacks a member of Model: close"),
        (("capabilities = CAP", "able = CAP"), "Brightness lacks a member of Model: capabilities"),
        (
            ("    n_tokens = None", "    count = None"),
            "Talk lacks a member of Conversation: n_tokens",
        ),
        (
            ("return Talk(self)", "return Talk(self, 1)"),
            "conversation() fails (TypeError in my_adapter.py:",
        ),
        (("return cls(name", "return clas(name"), "build() fails (NameError in my_adapter.py:"),
    ],
)
def test_an_incomplete_adapter_is_refused_by_a_run_in_one_line(folder, run_cli, edit, said):
    source = folder / "my_adapter.py"
    assert edit[0] in source.read_text()
    source.write_text(source.read_text().replace(*edit))
    code, _, err = run_cli("--model", NAME, "--tasks", "nieh_mini_gt", "--limit", 2)
    assert (code, len(err.splitlines())) == (2, 1), err
    assert f"model {NAME}: {said}" in err
    assert "docs/own-models.md" in err or "fix the adapter" in err


def test_an_error_in_an_adapter_says_where_and_keeps_its_traceback(folder, run_cli):
    source = folder / "my_adapter.py"
    source.write_text(
        source.read_text().replace('question = "".join(', 'question = None + "".join(')
    )
    code, _, err = run_cli("--model", NAME, "--tasks", "nieh_mini_gt", "--limit", 2)
    assert code == 1
    assert "Brightness fails on the request (TypeError in my_adapter.py:" in err
    model = load(NAME, {}, seed=0)
    with pytest.raises(ModelError) as raised, wrap_request_errors(model.name):
        start_conversation(model, "How many?").reply(Decoding(max_new_tokens=1))
    assert isinstance(raised.value.__cause__, TypeError)
    assert "my_adapter.py" in "".join(traceback.format_exception(raised.value))


def test_a_policy_is_checked_by_the_same_command(run_cli):
    code, out, err = run_cli("check", "adapter", "openvla-tiny")
    assert (code, err) == (0, "")
    assert [line.split()[1] for line in out.splitlines()[:-1]] == [
        "members",
        "identity",
        "episodes",
    ]


def test_the_place_of_the_file_changes_neither_name_nor_fingerprint(folder, monkeypatch):
    here = adapter_identity(NAME), label(NAME, {})
    (folder / "deeper").mkdir()
    monkeypatch.chdir(folder / "deeper")
    assert (
        adapter_identity("../my_adapter.py:Brightness"),
        label("../my_adapter.py:Brightness", {}),
    ) == here
    assert here[1] == "Brightness"
