"""What a dialect reads in a server's reply: one gate for all that servers say."""

from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import msgspec

from infthor_eval.errors import ModelError, wrap_errors
from model_adapters.served.wire import StatusError

T = TypeVar("T")

# Ends of replies at which the server failed: OpenRouter, vLLM and SGLang, Zhipu, DeepSeek, Google.
_BROKEN = {"error", "abort", "network_error", "insufficient_system_resource"}
_BROKEN |= {"OTHER", "MALFORMED_RESPONSE", "FINISH_REASON_UNSPECIFIED"}
_MOST_TOKENS = 2**48
_UNREADABLE = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)


@dataclass(frozen=True)
class TokenUsage:
    """Tokens of one request and its reply.

    Attributes:
        prompt_tokens: tokens of the request, frames included.
        completion_tokens: tokens of the reply, including its reasoning if the server counts that.
        n_cached: tokens of the request that were in the server's cache, or None if it does not
            report them.
        n_stored: tokens of the request that were put into the server's cache at a price of their
            own.
    """

    prompt_tokens: int
    completion_tokens: int
    n_cached: int | None = None
    n_stored: int = 0

    @property
    def total(self) -> int:
        """Tokens of request and reply."""
        return self.prompt_tokens + self.completion_tokens


class Completion(Protocol):
    """A reply that was parsed strictly."""

    @property
    def failure(self) -> StatusError | None:
        """The error in it, though its status is a success; None if it is a reply."""

    @property
    def tokens(self) -> TokenUsage | None:
        """Token counts, or None if the server does not report them."""

    @property
    def thinking(self) -> str | None:
        """What the model thought before its reply, if the server tells it apart."""

    def text(self, where: str) -> str:
        """Return the text of the reply; a refusal in words counts as a reply. The message names the
        server by `where`.

        The text is empty where the model was cut off while it thought.

        Raises:
            ModelError: the reply has no text.
        """


def decode_reply(where: str, content: bytes, kind: type[T], what: str) -> T:
    """Parse a server's reply, which may be anything; what is left raw in it is text in UTF-8."""
    problem = f"{where} does not answer with {what}"
    hint = "is it a chat model's address?"
    with wrap_errors(problem, hint, catch=_UNREADABLE, raise_as=ModelError):
        content.decode()
        return msgspec.json.decode(content, type=kind)


def read_usage(
    usage: msgspec.Raw, prompt: tuple[str, ...], reply: tuple[str, ...], cached: str, stored: str
) -> TokenUsage | None:
    """Return the sums of the counts of these names in `usage`; None if one has no count at all.
    What is no count is left out: a reply is worth more than its count."""
    fields = _fields(usage)
    details = fields.get("prompt_tokens_details")  # OpenAI's
    values = fields | (details if isinstance(details, dict) else {})
    n = {
        name: int(value)
        for name, value in values.items()
        if type(value) in (int, float) and 0 <= value <= _MOST_TOKENS and value == int(value)
    }
    if not (n.keys() & set(prompt) and n.keys() & set(reply)):
        return None
    n_prompt, n_reply = (sum(n.get(name, 0) for name in names) for names in (prompt, reply))
    n_cached = min(n[cached], n_prompt) if cached in n else None
    return TokenUsage(n_prompt, n_reply, n_cached, n.get(stored, 0))


def read_error(ending: str | None, *errors: msgspec.Raw) -> StatusError | None:
    """Return the error in a reply by its fields for one, the closest first, and why it ended; None
    if it has none, or ended well all the same. What tells no status may pass."""
    if ending and ending not in _BROKEN:
        return None
    for error in map(bytes, errors):
        if error not in (b"null", b"{}", b'""', b"false"):
            code = _fields(error).get("code")
            status = code if isinstance(code, int) and 400 <= code < 600 else 500
            return StatusError(status, b"in a 200: " + error, {})
    return StatusError(500, f"a 200 that ended with {ending}".encode(), {}) if ending else None


def _fields(raw: msgspec.Raw | bytes) -> dict[str, Any]:
    try:
        found = msgspec.json.decode(raw)
    except _UNREADABLE:
        return {}
    return found if isinstance(found, dict) else {}
