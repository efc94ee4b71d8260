"""The contract of memories finds each way to break it."""

import pytest

from infthor_eval.memory import MEMORIES, MemoryCapabilities, open_memory
from infthor_eval.memory.check import check_memory
from infthor_eval.memory.frames import Last


def broken(memory):
    return {result.name for result in check_memory(memory) if result.violation is not None}


@pytest.mark.parametrize("name", [name for name in MEMORIES.names if not name.startswith("clip")])
def test_those_built_in_keep_it(name):
    assert broken(open_memory(name)) == set()


def test_those_that_retrieve_keep_it_with_a_checkpoint(make_clip):
    for name in ("clip", "clip-view"):
        assert broken(open_memory(name, (("retriever", str(make_clip())),))) == set()


class Recalls(Last):
    """A memory that recalls something wrong."""

    def __init__(self, wrong):
        super().__init__(k=3)
        self.wrong = wrong

    def recall(self, query, budget):
        right = super().recall(query, budget)
        if self.wrong == "present":
            return [*right, query.present]
        if self.wrong == "path":
            return [*right, query.present.frame.path]
        if self.wrong == "empty text":
            return ["  "]
        if self.wrong == "budget":
            return super().recall(query, None)
        if self.wrong == "order":
            self.past = self.past[:-1]
        if self.wrong == "crash":
            raise KeyError("mug")
        return right


@pytest.mark.parametrize(
    ("wrong", "checks"),
    [
        ("present", {"recalls", "empty", "budget", "forgets"}),
        ("path", {"recalls", "empty", "budget", "forgets"}),
        ("empty text", {"recalls", "empty", "forgets", "budget"}),
        ("budget", {"budget"}),
        ("order", {"repeats"}),
        ("crash", {"recalls", "empty", "budget", "repeats", "forgets"}),
    ],
)
def test_a_wrong_recall_is_found(wrong, checks):
    assert broken(Recalls(wrong)) == checks


def test_a_memory_that_does_not_begin_anew_is_found():
    class Keeps(Last):
        def begin(self, facts):
            self.facts = facts

    assert "forgets" in broken(Keeps(k=30))


def test_members_and_identity_are_checked():
    class Nameless(Last):
        def identity(self):
            return {"path": open_memory}

    assert broken(Nameless()) == {"identity"}

    class Claims(Last):
        capabilities = frozenset({"privileged"})

    assert broken(Claims()) == {"members"}
    assert broken(object()) == {"members"}


def test_a_memory_that_is_not_deterministic_may_say_so():
    class Draws(Last):
        capabilities = MemoryCapabilities(deterministic=False)
        turn = 0

        def recall(self, query, budget):
            self.turn += 1
            return super().recall(query, budget)[self.turn % 2 :]

    assert broken(Draws()) == set()
