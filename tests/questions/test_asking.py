"""One conversation for many requests, and metrics of one's own that fail."""

from typing import Any

import pytest

from infthor_eval.questions.asking import MetricError, ModelReplier, Request, wrap_metric_errors
from model_adapters import Capabilities, Decoding, Reply, Transcript

GREEDY = Decoding(max_new_tokens=5)


class Echo:
    """A model whose reply is all that it was sent, and which counts what was sent to it."""

    name, capabilities = "echo", Capabilities(batch_contexts=True)

    def __init__(self) -> None:
        self.n_sent = 0

    def conversation(self) -> "Talk":
        return Talk(self)


class Talk(Transcript):
    """Its conversation."""

    def __init__(self, model: Echo) -> None:
        super().__init__()
        self.model = model

    def append(self, *parts: Any, **role: Any) -> None:
        self.model.n_sent += len(parts)
        super().append(*parts, **role)

    def reply(self, decoding: Decoding) -> Reply:
        return Reply("".join(str(part) for turn in self.turns for part in turn.parts))


def request(text: str, *context: str) -> Request[Any]:
    unit: Any = None
    return Request(unit, context, text, (), GREEDY)


def test_requests_in_one_context_share_it() -> None:
    model = Echo()
    replies = ModelReplier(model).answer([request(", one", "a", "b"), request(", two", "a", "b")])
    assert [reply.text for reply in replies] == ["ab, one", "ab, two"]
    assert model.n_sent == 2 + 1 + 1


def test_requests_in_other_contexts_have_their_own() -> None:
    replier = ModelReplier(Echo())
    replies = replier.answer(
        [request(", one", "a"), request(", two", "b", "c"), request(", three")]
    )
    assert [reply.text for reply in replies] == ["a, one", "bc, two", ", three"]
    assert replier.answer([request(", four", "d")])[0].text == "d, four"


def test_what_ends_the_program_is_no_metric_that_failed() -> None:
    with pytest.raises(KeyboardInterrupt), wrap_metric_errors("own.measure"):
        raise KeyboardInterrupt
    with (
        pytest.raises(MetricError, match=r"own\.measure: .*no such key"),
        wrap_metric_errors("own.measure"),
    ):
        raise KeyError("no such key")
