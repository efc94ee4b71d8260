"""The contract check passes good adapters and names the clause that a bad one breaks."""

import hashlib
import random
import threading
import time
from dataclasses import replace

import pytest

from infthor_eval.errors import ModelError
from model_adapters import (
    Capabilities,
    ContractError,
    Reply,
    Transcript,
    Turn,
    check_adapter,
    check_decoding,
    check_turns,
)

from ...helpers.refusals import read_one_line


class HashModel:
    """A model that keeps every clause of the contract and looks at frames through their digests."""

    name = "hash"
    capabilities = Capabilities()

    def tokens_per_frame(self, frame):
        return 10 if self.capabilities.counts_tokens else None

    def identity(self):
        return {"model": self.name}

    def conversation(self):
        return HashConversation(self.capabilities)

    def close(self):
        pass


class HashConversation(Transcript):
    def __init__(self, capabilities=Capabilities()):  # noqa: B008 - it is frozen
        super().__init__()
        self.capabilities = capabilities

    @property
    def n_tokens(self):
        return _size(self.turns) if self.capabilities.counts_tokens else None

    def reply(self, decoding):
        check_decoding("hash", self.capabilities, decoding)
        check_turns("hash", self.capabilities, self.turns)
        return self.hash_reply(decoding)

    def hash_reply(self, decoding):
        """The reply, whatever is asked."""
        text = self.text(decoding)
        ids = tuple(map(ord, text))
        for string in decoding.stop:
            text = text.split(string)[0]
        counted = (
            (len(ids), _size(self.turns), 0)
            if self.capabilities.counts_tokens
            else (None, None, None)
        )
        return Reply(text, *counted, ids if self.capabilities.token_ids else None)

    def text(self, decoding):
        parts = [(turn.role, part) for turn in self.turns for part in turn.parts]
        key = "\n".join(
            f"{role}:{part if isinstance(part, str) else part.digest}" for role, part in parts
        )
        if not decoding.greedy:
            key += f"\n{decoding.seed}"
        if not self.capabilities.deterministic:
            key += f"\n{random.random()}"
        whole = hashlib.sha256(key.encode()).hexdigest()
        if decoding.choices:
            return decoding.choices[int(whole, 16) % len(decoding.choices)]
        return whole[: decoding.max_new_tokens]


def _size(turns):
    return sum(
        len(part) if isinstance(part, str) else 10 for turn in turns for part in turn.parts
    ) + len(turns)


def _model(capabilities=Capabilities(), **methods):  # noqa: B008 - it is frozen
    """A model whose conversations have other methods."""
    talk = type("Talk", (HashConversation,), methods)
    about = {"capabilities": capabilities, "conversation": lambda self: talk(capabilities)}
    return type("Broken", (HashModel,), about)()


@pytest.mark.parametrize(
    "capabilities",
    [
        {},
        {"counts_tokens": False, "token_ids": False},
        {"counts_tokens": False, "token_ids": False, "deterministic": False},
        {"deterministic": False, "sampling": True},
        {"sampling": True, "choices": True, "max_in_flight": 8, "batch_size": 4},
        {"image_input": False, "max_in_flight": 8},
        {"image_input": False, "counts_tokens": False, "token_ids": False},
    ],
)
def test_a_good_model_passes(capabilities):
    check_adapter(_model(Capabilities(**capabilities)))


def _asked_as(method="reply", **changes):
    """A method that does as if something else had been asked for."""
    own = getattr(HashConversation, method)
    return lambda self, decoding: own(self, replace(decoding, **changes))


def _replying(**changes):
    """A `reply` that changes what is replied, each by what it is made from."""

    def reply(self, decoding):
        honest = HashConversation.reply(self, decoding)
        return replace(honest, **{name: make(self, honest) for name, make in changes.items()})

    return reply


def _answering(change):
    """A `replies` that changes the list, given the conversation and a way to have it."""
    return lambda self, continuations, decoding: change(
        self, continuations, lambda some: Transcript.replies(self, some, decoding)
    )


def _reply_that_appends(self, decoding):
    reply = HashConversation.reply(self, decoding)
    self.append(reply.text)
    return reply


def _reply_without_frames(self, decoding):
    blind = HashConversation()
    for turn in self.turns:
        blind.append(*(part for part in turn.parts if isinstance(part, str)), role=turn.role)
    return replace(blind.reply(decoding), n_context_tokens=self.n_tokens)


def _text_that_counts_calls(self, reply):
    self.calls = getattr(self, "calls", 0) + 1
    return reply.text + str(self.calls)


def _reply_to_anything(self, decoding):
    check_decoding("hash", self.capabilities, decoding)
    return self.hash_reply(decoding)


def _reply_to_the_assistant(self, decoding):
    if not self.turns:
        raise ModelError("nothing")
    return _reply_to_anything(self, decoding)


def _rewind_that_counts(self, mark):
    self.rewound = 1
    HashConversation.rewind(self, mark)


def _append_anything(self, *parts, role="user"):
    HashConversation.append(self, *(part for part in parts if not isinstance(part, int)), role=role)


def _append_in_any_role(self, *parts, role="user"):
    HashConversation.append(self, *parts, role="user" if role == "narrator" else role)


def _turns_without_joints(self, continuation):
    return tuple(Turn(role, (part,)) for role, part in self._spoken)


def _rewind_anywhere(self, mark):
    del self._spoken[mark.n_parts :]


def _replies_that_append(self, continuations, answer):
    self.append(*continuations[0])
    return answer(continuations)


@pytest.mark.parametrize(
    ("methods", "clause"),
    [
        ({"reply": _reply_that_appends}, "reply.. changes the conversation"),
        ({"reply": _reply_without_frames}, "does not see the frames"),
        ({"reply": _asked_as(stop=())}, "stop string"),
        ({"reply": _replying(text=_text_that_counts_calls)}, "not answered the same way twice"),
        (
            {"reply": _replying(n_context_tokens=lambda _, reply: reply.n_context_tokens + 1)},
            "not the reply's n_context_tokens",
        ),
        (
            {
                "reply": _replying(
                    text=lambda self, reply: reply.text + "x" * getattr(self, "rewound", 0)
                ),
                "rewind": _rewind_that_counts,
            },
            "after a rewind differs from that of a new conversation",
        ),
        ({"append": _append_anything}, "does not raise TypeError"),
        ({"rewind": _rewind_anywhere}, "behind the point rewound to"),
        ({"rewind": lambda self, mark: None}, "does not bring back n_tokens"),
        ({"n_tokens": 7}, "n_tokens does not grow"),
        ({"append": _append_in_any_role}, "in an unknown role does not raise"),
        ({"turns_with": _turns_without_joints}, "in two pieces differs from the same text in one"),
        (
            {"reply": _reply_to_anything},
            "reply.. to an empty conversation does not raise ModelError; call",
        ),
        (
            {"reply": _reply_to_the_assistant},
            "whose last turn is the assistant's does not raise ModelError",
        ),
        ({"reply": _replying(token_ids=lambda *_: None)}, "a reply has no token_ids"),
        (
            {"reply": _replying(n_reply_tokens=lambda *_: 0)},
            "n_reply_tokens is not the number of token_ids",
        ),
        (
            {"reply": _asked_as(temperature=0.0)},
            "a temperature does not raise ModelError though sampling is false; call",
        ),
        (
            {"reply": _asked_as(choices=())},
            "choices do not raise ModelError though choices is false; call",
        ),
        (
            {"replies": _answering(lambda _, asked, answer: answer(asked[:1]))},
            "one reply per continuation",
        ),
        (
            {"replies": _answering(lambda _, asked, answer: answer(asked)[::-1])},
            "replies.. differs from asking one by one",
        ),
        ({"replies": _answering(_replies_that_append)}, "replies.. changes the conversation"),
    ],
)
def test_a_broken_conversation_is_named(methods, clause):
    with pytest.raises(ContractError, match=clause) as caught:
        check_adapter(_model(**methods))
    read_one_line(caught)


def _claiming(**capabilities):
    """Capabilities that are not those of the model's conversations."""
    return {
        "capabilities": Capabilities(**capabilities),
        "conversation": lambda self: HashConversation(),
    }


@pytest.mark.parametrize(
    ("members", "clause"),
    [
        ({"identity": lambda self: {"a": {1}}}, "is a set, which JSON cannot hold"),
        ({"identity": lambda self: {"a": (1,)}}, "changes when written as JSON"),
        ({"tokens_per_frame": lambda *_: 0}, "tokens_per_frame"),
        ({"tokens_per_frame": lambda *_: 11}, "tokens_per_frame"),
        (
            {"tokens_per_frame": lambda *_: 10, "capabilities": Capabilities(counts_tokens=False)},
            r"tokens_per_frame\(\) is not None",
        ),
        (_claiming(counts_tokens=False), "n_tokens is not None though counts_tokens is false"),
        (_claiming(token_ids=False), "a reply has token_ids though token_ids is false"),
        (_claiming(batch_size=0), "batch_size is below 1"),
        (_claiming(max_in_flight=0), "max_in_flight is below 1"),
        (
            {"conversation": lambda self: Transcript()},
            "Transcript lacks a member of Conversation: n_tokens, reply",
        ),
    ],
)
def test_a_broken_model_is_named(members, clause):
    with pytest.raises(ContractError, match=clause):
        check_adapter(type("Broken", (HashModel,), members)())


def test_what_is_no_model_is_named():
    with pytest.raises(ContractError, match=r"object lacks a member of Model: .*tokens_per_frame"):
        check_adapter(object())


def test_a_model_that_takes_frames_though_it_claims_not_to_is_named():
    model = _model(Capabilities(image_input=False), reply=_reply_to_any_parts)
    with pytest.raises(ContractError, match="a frame does not raise ModelError though image_input"):
        check_adapter(model)


def _reply_to_any_parts(self, decoding):
    check_decoding("hash", self.capabilities, decoding)
    check_turns("hash", Capabilities(), self.turns)
    return self.hash_reply(decoding)


def _text_drawn_anew(self, decoding):
    other = replace(decoding, seed=decoding.seed + random.getrandbits(60))
    return HashConversation.text(self, other)


@pytest.mark.parametrize(
    ("able", "text", "clause"),
    [
        ("sampling", _asked_as("text", temperature=0.0), "no seed changes a reply at temperature"),
        ("sampling", _text_drawn_anew, "the same seed does not give the same reply"),
        ("choices", _asked_as("text", choices=()), "a reply is none of its choices"),
    ],
)
def test_a_claim_that_does_not_hold_is_named(able, text, clause):
    with pytest.raises(ContractError, match=clause):
        check_adapter(_model(Capabilities(**{able: True}), text=text))


def test_replies_that_hang_on_who_else_asks_are_named():
    flying = []
    lock = threading.Lock()

    def text(self, decoding):
        with lock:
            flying.append(1)
        time.sleep(0.05)
        crowd = len(flying)
        with lock:
            flying.pop()
        return ("x" if crowd > 1 else "y") + HashConversation.text(self, decoding)[:-1]

    check_adapter(_model(text=text))
    with pytest.raises(ContractError, match="at the same time differ"):
        check_adapter(_model(Capabilities(max_in_flight=4), text=text))
