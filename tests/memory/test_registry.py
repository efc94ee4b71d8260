"""Memories by name, with options, and from a user's file."""

import time

import pytest
from PIL import Image

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
SOURCE = """
def recall(images, question, k=2):
    assert images[0].size == images[:1][0].size
    return [len(images) - 1, 0, len(images) - 1, 1][:k + 1]


def wrong(images, question):
    return ["first"]


def beyond(images, question):
    return [len(images)]


def other(frames):
    return []
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


@pytest.fixture
def asked(tmp_path, observed):
    """Recalls what a function of the file names of a trajectory of five frames."""
    file = tmp_path / "mine.py"
    file.write_text(SOURCE)

    def ask(name, budget=None, tokens_per_frame=10, n_frames=5, **options):
        memory = open_memory(f"{file}:{name}", tuple(sorted(options.items())))
        recall = observed(memory, n_frames, tokens_per_frame, name=str(tmp_path))
        return [step.number for step in recall(budget=budget)]

    for number in range(5):
        Image.new("RGB", (8, 8)).save(tmp_path / f"{number}.png")
    return ask


def test_what_it_names_is_shown_once_in_time_order(asked):
    assert asked("recall") == [0, 4]
    assert asked("recall", k="3") == [0, 1, 4]


def test_the_most_important_fit_the_budget(asked):
    assert asked("recall", budget=19) == [4]
    assert asked("recall", budget=9) == []
    assert asked("recall", budget=9, tokens_per_frame=None) == [0, 4]


@pytest.mark.parametrize("name", ["wrong", "beyond"])
def test_what_is_no_number_of_an_image_is_an_error(asked, name):
    with pytest.raises(UserCodeError, match=r"return the numbers of images, from 0 to 4"):
        asked(name)


def test_a_question_before_the_first_image_is_answered_by_nothing(asked):
    with pytest.raises(UserCodeError, match=r"returned \[0\]; return nothing .* `return \[\]`"):
        asked("beyond", n_frames=0)


def test_other_functions_and_options_are_refused(asked):
    with pytest.raises(ModelError, match=r"write other\(images, question\)"):
        asked("other")
    with pytest.raises(UsageError, match="has no option n; it has k"):
        asked("recall", n=1)
