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


def _able(**capabilities):
    return type("Able", (HashModel,), {"capabilities": Capabilities(**capabilities)})()


@pytest.mark.parametrize(
    "capabilities",
    [
        {},
        {"counts_tokens": False, "token_ids": False},
        {"counts_tokens": False, "token_ids": False, "deterministic": False},
        {"deterministic": False, "sampling": True},
        {"sampling": True, "choices": True, "max_in_flight": 8, "batch_size": 4},
    ],
)
def test_a_good_model_passes(capabilities):
    check_adapter(_able(**capabilities))


def _model(**methods):
    talk = type("Talk", (HashConversation,), methods)
    return type("Broken", (HashModel,), {"conversation": lambda self: talk()})()


def _reply_that_appends(self, decoding):
    reply = HashConversation.reply(self, decoding)
    self.append(reply.text)
    return reply


def _reply_without_frames(self, decoding):
    blind = HashConversation()
    for turn in self.turns:
        blind.append(*(part for part in turn.parts if isinstance(part, str)), role=turn.role)
    return replace(blind.reply(decoding), n_context_tokens=self.n_tokens)


def _reply_without_stop(self, decoding):
    return HashConversation.reply(self, replace(decoding, stop=()))


def _reply_with_a_memory(self, decoding):
    self.calls = getattr(self, "calls", 0) + 1
    reply = HashConversation.reply(self, decoding)
    return replace(reply, text=reply.text + str(self.calls))


def _reply_that_miscounts(self, decoding):
    reply = HashConversation.reply(self, decoding)
    return replace(reply, n_context_tokens=(reply.n_context_tokens or 0) + 1)


def _reply_that_remembers_what_was_rewound(self, decoding):
    reply = HashConversation.reply(self, decoding)
    return replace(reply, text=reply.text + "x" * getattr(self, "rewound", 0))


def _reply_to_anything(self, decoding):
    check_decoding("hash", self.capabilities, decoding)
    return self.hash_reply(decoding)


def _reply_to_the_assistant(self, decoding):
    check_decoding("hash", self.capabilities, decoding)
    if not self.turns:
        raise ModelError("nothing")
    return self.hash_reply(decoding)


def _reply_without_ids(self, decoding):
    return replace(HashConversation.reply(self, decoding), token_ids=None)


def _reply_with_more_ids(self, decoding):
    return replace(HashConversation.reply(self, decoding), n_reply_tokens=0)


def _reply_at_any_temperature(self, decoding):
    return HashConversation.reply(self, replace(decoding, temperature=0.0))


def _reply_with_any_choices(self, decoding):
    return HashConversation.reply(self, replace(decoding, choices=()))


def _replies_to_the_first(self, continuations, decoding):
    return Transcript.replies(self, continuations[:1], decoding)


def _replies_backwards(self, continuations, decoding):
    return Transcript.replies(self, continuations, decoding)[::-1]


def _replies_that_append(self, continuations, decoding):
    self.append(*continuations[0])
    return Transcript.replies(self, continuations, decoding)


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
        ({"reply": _reply_without_ids}, "a reply has no token_ids"),
        ({"reply": _reply_with_more_ids}, "n_reply_tokens is not the number of token_ids"),
        (
            {"reply": _reply_at_any_temperature},
            "a temperature does not raise ModelError though sampling is false; call",
        ),
        (
            {"reply": _reply_with_any_choices},
            "choices do not raise ModelError though choices is false; call",
        ),
        ({"replies": _replies_to_the_first}, "one reply per continuation"),
        ({"replies": _replies_backwards}, "replies.. differs from asking one by one"),
        ({"replies": _replies_that_append}, "replies.. changes the conversation"),
    ],
)
def test_a_broken_conversation_is_named(methods, clause):
    with pytest.raises(ContractError, match=clause) as caught:
        check_adapter(_model(**methods))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("identity", "clause"),
    [
        (lambda self: {"a": {1}}, "is a set, which JSON cannot hold"),
        (lambda self: {"a": (1,)}, "changes when written as JSON"),
    ],
)
def test_a_broken_identity_is_named(identity, clause):
    with pytest.raises(ContractError, match=clause):
        check_adapter(type("Broken", (HashModel,), {"identity": identity})())


@pytest.mark.parametrize("count", [0, 11])
def test_a_wrong_count_of_a_frames_tokens_is_named(count):
    broken = type("Broken", (HashModel,), {"tokens_per_frame": lambda self, frame: count})()
    with pytest.raises(ContractError, match="tokens_per_frame"):
        check_adapter(broken)


@pytest.mark.parametrize(
    ("claims", "clause"),
    [
        ({"counts_tokens": False}, "n_tokens is not None though counts_tokens is false"),
        ({"token_ids": False}, "a reply has token_ids though token_ids is false"),
        ({"batch_size": 0}, "batch_size is below 1"),
        ({"max_in_flight": 0}, "max_in_flight is below 1"),
    ],
)
def test_capabilities_that_are_not_the_models_are_named(claims, clause):
    broken = type("Broken", (HashModel,), {"capabilities": Capabilities(**claims)})()
    broken.conversation = HashConversation
    with pytest.raises(ContractError, match=clause):
        check_adapter(broken)


def test_a_count_of_a_frames_tokens_by_a_model_that_counts_none_is_named():
    broken = _able(counts_tokens=False)
    broken.tokens_per_frame = lambda frame: 10
    with pytest.raises(ContractError, match=r"tokens_per_frame\(\) is not None"):
        check_adapter(broken)


def _talking(capabilities, **methods):
    talk = type("Talk", (HashConversation,), methods)
    return type(
        "Broken",
        (HashModel,),
        {"capabilities": capabilities, "conversation": lambda self: talk(capabilities)},
    )()


def _text_of_no_seed(self, decoding):
    return HashConversation.text(self, replace(decoding, temperature=0.0))


def _text_of_no_choice(self, decoding):
    return HashConversation.text(self, replace(decoding, choices=()))


def _text_drawn_anew(self, decoding):
    return HashConversation.text(
        self, replace(decoding, seed=decoding.seed + random.getrandbits(60))
    )


@pytest.mark.parametrize(
    ("capabilities", "text", "clause"),
    [
        (Capabilities(sampling=True), _text_of_no_seed, "no seed changes a reply at temperature 2"),
        (
            Capabilities(sampling=True),
            _text_drawn_anew,
            "the same seed does not give the same reply",
        ),
        (Capabilities(choices=True), _text_of_no_choice, "a reply is none of its choices"),
    ],
)
def test_a_claim_that_does_not_hold_is_named(capabilities, text, clause):
    with pytest.raises(ContractError, match=clause):
        check_adapter(_talking(capabilities, text=text))


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

    check_adapter(_talking(Capabilities(), text=text))
    with pytest.raises(ContractError, match="at the same time differ"):
        check_adapter(_talking(Capabilities(max_in_flight=4), text=text))


def test_what_is_missing_is_named():
    with pytest.raises(ContractError, match=r"object lacks a member of Model: .*tokens_per_frame"):
        check_adapter(object())
    silent = type("Silent", (HashModel,), {"conversation": lambda self: Transcript()})()
    with pytest.raises(
        ContractError, match="Transcript lacks a member of Conversation: n_tokens, reply"
    ):
        check_adapter(silent)
