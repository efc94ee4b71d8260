"""Requests to a server, with retries of transient failures and one-line errors for others."""

import email.utils
import random
import re
import time
from collections.abc import Callable, Mapping
from http import HTTPStatus
from threading import Event
from typing import TypeVar

from infthor_eval.errors import ModelError, in_one_line
from model_adapters.served.options import ServedOptions
from model_adapters.served.secret import Secret
from model_adapters.served.spend import RateLimiter
from model_adapters.served.wire import (
    Answer,
    Call,
    StatusError,
    UnreachableError,
    UnreadableError,
    Wire,
)

T = TypeVar("T")

_FIRST_WAIT_S = 0.5  # pause before the second attempt; it doubles before each further one
_LONGEST_WAIT_S = 60.0
_LONGEST_RETRY_AFTER_S = 600.0  # longest pause that a server may request
_QUOTED = 200  # characters of a server's text in a message
_TRANSIENT = (408, 409, 425, 429)  # besides all server errors, from 500 on
_QUOTA_EXCEEDED = b"insufficient_quota"  # comes with status 429, but waiting does not help
_HINTS = {
    300: "redirects are not followed: give the new address as base_url",
    401: "set the environment variable that api_key_env names to a valid key",
    402: "check your account",
    403: "set the environment variable that api_key_env names to a key with access to this model",
    404: "check base_url and model",
    413: "use fewer frames, or set image_format=jpeg",
    429: "lower max_in_flight, or set requests_per_minute and tokens_per_minute",
    500: "see the server's log",
}
_RETRY_DELAY = re.compile(rb'"retryDelay":\s*"(\d{1,9}(?:\.\d{1,9})?)s"')  # Google's, in the body
# A message of vLLM's, and the hint to it.
_TOO_MANY_FRAMES = b"may be provided in one prompt"
_MORE_FRAMES = (
    "start the server with a higher --limit-mm-per-prompt '{\"image\": N}', or use fewer frames"
)


class _TransientError(Exception):
    """A failure that a retry may cure.

    Attributes:
        hint: how to fix it if retries do not help.
        wait_s: pause that the server requests, in seconds, or None.
        busy: true if the server works and only has too many requests.
    """

    def __init__(
        self, message: str, hint: str, wait_s: float | None = None, *, busy: bool = False
    ) -> None:
        super().__init__(message)
        self.hint = hint
        self.wait_s = wait_s
        self.busy = busy


class NoAnswerError(ModelError):
    """All attempts of a request failed, for reasons that may pass."""


def is_transient(status: int) -> bool:
    """Return whether what a status says may pass."""
    return status in _TRANSIENT or status >= 500


class Endpoint:
    """One server, for any number of threads.

    After a request has failed in all its attempts, later requests get one attempt each until one
    succeeds: otherwise every sample of a run would wait through all retries of a server that is
    down.
    """

    def __init__(
        self, options: ServedOptions, secret: Secret, headers: Mapping[str, str], hint: str
    ) -> None:
        """Take the options, the key, the headers of every request, and the hint to refusals."""
        self.where = options.url
        self._options = options
        self._secret = secret
        self._hint = hint
        self._wire = Wire(options, headers)
        self._limiter = RateLimiter(options.requests_per_minute)
        self._is_down = Event()

    def ask(self, call: Call) -> tuple[Answer, tuple[str, ...]]:
        """Return the reply to a request, and a line for each fault that a retry recovered from.

        Raises:
            NoAnswerError: all attempts failed.
            ModelError: the server answers with an error that a retry would not cure.
        """
        answer, faults = self.ask_unless_done(call, lambda: None)
        return answer, faults

    def ask_unless_done(
        self, call: Call, find: Callable[[], T | None]
    ) -> tuple[Answer | T, tuple[str, ...]]:
        """Ask as `ask` does, for what must not be done twice: before each further attempt, `find`
        looks whether an earlier one, whose reply was lost, has done it, and returns what it finds
        instead of the reply."""
        faults: list[str] = []
        n_attempts = 1 if self._is_down.is_set() else 1 + self._options.retries
        while True:
            done = find() if faults else None
            if done is not None:
                return done, tuple(faults)
            self._limiter.wait()
            try:
                answer = self._send_once(call)
            except _TransientError as fault:
                faults.append(f"{self.where} {fault}")
                if len(faults) == n_attempts:
                    if not fault.busy:
                        self._is_down.set()
                    raise NoAnswerError(
                        f"{self.where} {fault}, in {n_attempts} attempts; {fault.hint}"
                    ) from fault
                time.sleep(_pause_s(len(faults), fault))
            else:
                self._is_down.clear()
                return answer, tuple(faults)

    def close(self) -> None:
        """Close all connections."""
        self._wire.close()

    def _send_once(self, call: Call) -> Answer:
        try:
            answer = self._wire.send(call)
            failure = call.failure(answer.content)
            if failure is not None and failure.status:  # what is no reply is told where it is used
                raise failure
            return answer
        except TimeoutError as error:
            timeout_s = self._options.timeout_s if call.timeout_s is None else call.timeout_s
            raise _TransientError(
                f"does not answer within {timeout_s:g} s", "raise timeout_s if it is slow"
            ) from error
        except UnreadableError as error:
            raise ModelError(f"{self.where} {error}; is it a chat model's address?") from error
        except UnreachableError as error:
            reason = self._secret.redact(in_one_line(error))
            raise _TransientError(f"cannot be reached ({reason})", "is the server up?") from error
        except StatusError as error:
            raise self._classify(error) from error

    def _classify(self, error: StatusError) -> _TransientError | ModelError:
        status = error.status
        problem = self.describe(status, error.content)
        hint = _MORE_FRAMES if _TOO_MANY_FRAMES in error.content else self._hint_to(status)
        if not is_transient(status) or (status == 429 and _QUOTA_EXCEEDED in error.content):
            return ModelError(f"{self.where} {problem}; {hint}")
        wait_s = _retry_after_s(error.headers)
        if wait_s is None:
            wait_s = _retry_delay_s(error.content)
        if wait_s is not None and wait_s > _LONGEST_RETRY_AFTER_S:
            return ModelError(
                f"{self.where} {problem}, and asks to wait {wait_s:.0f} s; run the same command "
                "again then: it resumes"
            )
        return _TransientError(problem, hint, wait_s, busy=status == 429)

    def describe(self, status: int, body: bytes) -> str:
        """Return a status and the words that came with it, in one line without the key."""
        phrase = f" {HTTPStatus(status).phrase}" if status in set(HTTPStatus) else ""
        return f"answers {status}{phrase}: {self._quote(body)}"

    def _hint_to(self, status: int) -> str:
        """Return how to fix what a status says."""
        return _HINTS.get(status) or _HINTS.get(status // 100 * 100) or self._hint

    def _quote(self, body: bytes) -> str:
        text = self._secret.redact(body.decode("utf-8", "replace"))
        short = " ".join(text.split())[:_QUOTED]
        return repr(short) if short else "nothing"


def _pause_s(n_faults: int, fault: _TransientError) -> float:
    """Return the server's pause, or one that doubles, plus a random part to spread threads."""
    pause = min(_FIRST_WAIT_S * 2 ** (n_faults - 1), _LONGEST_WAIT_S) * (1 + random.random() / 4)
    return pause if fault.wait_s is None else fault.wait_s + random.random() * _FIRST_WAIT_S


def _retry_after_s(headers: Mapping[str, str]) -> float | None:
    """Return the pause that a server requests, in seconds from now, or None if there is none or it
    is not readable."""
    try:
        if "retry-after-ms" in headers:
            return max(0.0, float(headers["retry-after-ms"]) / 1000)
        value = headers.get("retry-after", "")
        if value.replace(".", "", 1).isdecimal():
            return max(0.0, float(value))
        return max(0.0, email.utils.parsedate_to_datetime(value).timestamp() - time.time())
    except (ValueError, OverflowError):
        return None


def _retry_delay_s(body: bytes) -> float | None:
    """Return the pause that the body of an error requests, in seconds, or None."""
    found = _RETRY_DELAY.search(body)
    return None if found is None else float(found[1])
