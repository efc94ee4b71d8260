"""Memories by name, with options, and from a user's file."""

import time

import pytest

from infthor_eval.errors import ModelError, UsageError, UserCodeError
from infthor_eval.memory import MEMORIES, memory_identity, open_memory, parse_options
from infthor_eval.memory.frames import Last
from infthor_eval.memory.registry import wrap_memory_errors
from infthor_eval.storage.limits import MEMORY_SECONDS

MINE = """
from infthor_eval.memory import MemoryCapabilities


class Mine:
    capabilities = MemoryCapabilities()

    def __init__(self, n: int = 3):
        self.n = n

    def identity(self):
        return {"checkpoint": "x"}

    def begin(self, facts):
        self.past = []

    def observe(self, observation):
        self.past.append(observation)

    def recall(self, query, budget):
        return self.past[: self.n]


class Half:
    def begin(self, facts):
        pass
"""


@pytest.fixture
def mine(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(MINE)
    return path


def test_every_name_opens_with_its_defaults():
    for name in MEMORIES.names:
        assert open_memory(name).capabilities
    assert isinstance(open_memory("last"), Last)


def test_options_are_converted_and_in_the_identity(mine):
    memory = open_memory(f"{mine}:Mine", (("n", "5"),))
    assert memory.n == 5
    identity = memory_identity(f"{mine}:Mine", (("n", "5"),))
    assert identity["checkpoint"] == "x"
    assert identity["memory"]["name"] == "Mine"
    assert identity["memory"]["options"] == {"n": "5"}
    before = identity["memory"]["source"]
    mine.write_text(MINE + "\n# another version\n")
    assert memory_identity(f"{mine}:Mine", (("n", "5"),))["memory"]["source"] != before


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("lats", (), "unknown memory 'lats'; did you mean 'last'?"),
        ("last", (("n", "3"),), "the memory last has no option n; it has k"),
        ("last", (("k", "many"),), "the memory last: k is 'many'"),
        ("last", (("k", "0"),), "the memory last cannot be made"),
        ("text-log", (("k", "3"),), "the memory text-log has no option k; it has none"),
    ],
)
def test_what_cannot_be_is_one_line(name, options, words):
    with pytest.raises(UsageError) as caught:
        open_memory(name, options)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_without_the_class_or_with_half_a_memory_is_named(mine):
    with pytest.raises(ModelError, match="has no class Nothing"):
        open_memory(f"{mine}:Nothing")
    with pytest.raises(UsageError, match="lacks capabilities, identity, observe, recall"):
        open_memory(f"{mine}:Half")


def test_options_are_read_as_pairs():
    assert parse_options(None) is None
    assert parse_options("k=3, retriever=./clip") == {"k": "3", "retriever": "./clip"}
    with pytest.raises(UsageError, match="--memory-args: 'k' is not of the form key=value"):
        parse_options("k")


def test_an_edited_file_is_another_memory_in_the_same_process(mine):
    first = open_memory(f"{mine}:Mine")
    assert open_memory(f"{mine}:Mine") is first
    mine.write_text(MINE.replace("n: int = 3", "n: int = 4"))
    assert open_memory(f"{mine}:Mine").n == 4


def test_a_call_of_a_memory_has_a_limit(monkeypatch):
    monkeypatch.setenv(MEMORY_SECONDS.name, "1")
    late = f"mine is not done after 1 s; fix it; if this is intended, set {MEMORY_SECONDS.name} to"
    with pytest.raises(UserCodeError, match=late), wrap_memory_errors("mine"):
        time.sleep(600)
