"""The contract check passes good adapters and names the clause that a bad one breaks."""

import hashlib
from collections.abc import Callable, Sequence
from typing import Any

import pytest

from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.question import Question
from model_adapters import ContractError, Mark, Model, Part, Reply, Transcript, check_adapter, check_bound

Method = Callable[..., Any]


class HashModel:
    """A model that keeps every clause of the contract and looks at frames through their digests."""

    name = "hash"
    max_tokens = None

    def tokens_per_frame(self, frame: FrameRef) -> int:
        return 10

    def identity(self) -> dict[str, Any]:
        return {"model": self.name}

    def conversation(self) -> "HashConversation":
        return HashConversation()

    def close(self) -> None:
        pass


class HashConversation(Transcript):
    @property
    def n_tokens(self) -> int:
        return sum(len(part) if isinstance(part, str) else 10 for part in self.parts) + 1

    def reply(self, max_new_tokens: int, stop: Sequence[str] = ()) -> Reply:
        if max_new_tokens < 1:
            raise ValueError("max_new_tokens")
        key = "\n".join(part if isinstance(part, str) else part.digest for part in self.parts)
        text = hashlib.sha256(key.encode()).hexdigest()[:max_new_tokens]
        ids = tuple(map(ord, text))
        for string in stop:
            text = text.split(string)[0]
        return Reply(text, ids, self.n_tokens, 0)


def test_a_good_model_passes() -> None:
    check_adapter(HashModel())


def _model(**methods: Any) -> Model:
    talk = type("Talk", (HashConversation,), methods)
    return type("Broken", (HashModel,), {"conversation": lambda self: talk()})()


def _reply_that_appends(self: Any, max_new_tokens: int, stop: Sequence[str] = ()) -> Reply:
    reply = HashConversation.reply(self, max_new_tokens, stop)
    self.append(reply.text)
    return reply


def _reply_without_frames(self: Any, max_new_tokens: int, stop: Sequence[str] = ()) -> Reply:
    blind = HashConversation()
    blind.append(*(part for part in self.parts if isinstance(part, str)))
    reply = blind.reply(max_new_tokens, stop)
    return Reply(reply.text, reply.token_ids, self.n_tokens, 0)


def _reply_without_stop(self: Any, max_new_tokens: int, stop: Sequence[str] = ()) -> Reply:
    return HashConversation.reply(self, max_new_tokens)


def _reply_with_a_memory(self: Any, max_new_tokens: int, stop: Sequence[str] = ()) -> Reply:
    self.calls = getattr(self, "calls", 0) + 1
    reply = HashConversation.reply(self, max_new_tokens, stop)
    return Reply(reply.text + str(self.calls), reply.token_ids, reply.n_context_tokens, 0)


def _reply_that_miscounts(self: Any, max_new_tokens: int, stop: Sequence[str] = ()) -> Reply:
    reply = HashConversation.reply(self, max_new_tokens, stop)
    return Reply(reply.text, reply.token_ids, reply.n_context_tokens + 1, 0)


def _reply_that_remembers_what_was_rewound(self: Any, max_new_tokens: int, stop: Sequence[str] = ()) -> Reply:
    reply = HashConversation.reply(self, max_new_tokens, stop)
    text = reply.text + "x" * getattr(self, "rewound", 0)
    return Reply(text, reply.token_ids, reply.n_context_tokens, 0)


def _rewind_that_counts(self: Any, mark: Mark) -> None:
    self.rewound = 1
    HashConversation.rewind(self, mark)


def _append_anything(self: Any, *parts: Part) -> None:
    self._parts.extend(part for part in parts if not isinstance(part, int))


def _rewind_anywhere(self: Any, mark: Mark) -> None:
    del self._parts[mark.n_parts :]


@pytest.mark.parametrize(
    ("methods", "clause"),
    [
        ({"reply": _reply_that_appends}, "reply.. changes the conversation"),
        ({"reply": _reply_without_frames}, "does not see the frames"),
        ({"reply": _reply_without_stop}, "stop string"),
        ({"reply": _reply_with_a_memory}, "not answered the same way twice"),
        ({"reply": _reply_that_miscounts}, "not the reply's n_context_tokens"),
        (
            {"reply": _reply_that_remembers_what_was_rewound, "rewind": _rewind_that_counts},
            "after a rewind differs from that of a fresh conversation",
        ),
        ({"append": _append_anything}, "does not raise TypeError"),
        ({"rewind": _rewind_anywhere}, "behind the point rewound to"),
        ({"rewind": lambda self, mark: None}, "does not bring back n_tokens"),
        ({"n_tokens": 7}, "n_tokens does not grow"),
    ],
)
def test_a_broken_conversation_is_named(methods: dict[str, Any], clause: str) -> None:
    with pytest.raises(ContractError, match=clause) as caught:
        check_adapter(_model(**methods))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("identity", "clause"),
    [(lambda self: {"a": {1}}, "JSON values"), (lambda self: {"a": (1,)}, "changes when written as JSON")],
)
def test_a_broken_identity_is_named(identity: Method, clause: str) -> None:
    with pytest.raises(ContractError, match=clause):
        check_adapter(type("Broken", (HashModel,), {"identity": identity})())


@pytest.mark.parametrize("count", [0, 11])
def test_a_wrong_count_of_a_frames_tokens_is_named(count: int) -> None:
    broken = type("Broken", (HashModel,), {"tokens_per_frame": lambda self, frame: count})()
    with pytest.raises(ContractError, match="tokens_per_frame"):
        check_adapter(broken)


def test_something_else_is_no_model() -> None:
    with pytest.raises(ContractError, match="lacks a member"):
        check_adapter(object())  # type: ignore[arg-type]


def test_a_bound_that_depends_on_the_order_is_named() -> None:
    class Counting:
        name = "counting"

        def __init__(self) -> None:
            self.asked = 0

        def identity(self) -> dict[str, Any]:
            return {}

        def study(self, questions: Sequence[Question]) -> None:
            pass

        def answer(self, question: Question) -> str:
            self.asked += 1
            return str(self.asked)

    with pytest.raises(ContractError, match="order of asking"):
        check_bound(Counting(), [Question("t", str(i), (0,), ("a",)) for i in range(2)])
