"""Requests to a server, with retries of transient failures and one-line errors for others."""

import email.utils
import random
import time
from collections.abc import Mapping
from http import HTTPStatus
from threading import Event
from typing import Any

import openai

from infthor_eval.errors import ModelError, in_one_line
from model_adapters.openai.options import OpenAIOptions
from model_adapters.openai.secret import Secret
from model_adapters.openai.spend import RateLimiter
from model_adapters.openai.wire import UnreadableError, Wire

__all__ = ["Endpoint"]

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
    404: "check base_url (it ends before /chat/completions) and model",
    413: "use fewer frames, or set image_format=jpeg",
    429: "lower max_in_flight, or set requests_per_minute and tokens_per_minute",
    500: "see the server's log",
}
_OTHER_HINT = (
    "check model and the options of requests (send_seed, send_temperature, send_stop, "
    "send_repetition_penalty, send_skip_special_tokens, max_tokens_field)"
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


class Endpoint:
    """One server, for any number of threads.

    After a request has failed in all its attempts, later requests get one attempt each until one
    succeeds: otherwise every sample of a run would wait through all retries of a server that is
    down. The client's own retries would neither be recorded, nor count in the rate limit, nor be
    known to the other threads, and they wait for at most 8 s.
    """

    def __init__(self, options: OpenAIOptions, secret: Secret) -> None:
        self.where = options.url
        self._options = options
        self._secret = secret
        self._wire = Wire(options, secret)
        self._limiter = RateLimiter(options.requests_per_minute)
        self._is_down = Event()

    def ask(self, request: Mapping[str, Any]) -> tuple[bytes, tuple[str, ...]]:
        """Return the reply's body to a chat completion request, and a line for each fault that a
        retry recovered from.

        Raises:
            ModelError: the server does not answer, or answers with an error.
        """
        faults: list[str] = []
        n_attempts = 1 if self._is_down.is_set() else 1 + self._options.retries
        while True:
            self._limiter.wait()
            try:
                content = self._send_once(request)
            except _TransientError as fault:
                faults.append(f"{self.where} {fault}")
                if len(faults) == n_attempts:
                    if not fault.busy:
                        self._is_down.set()
                    raise ModelError(
                        f"{self.where} {fault}, in {n_attempts} attempts; {fault.hint}"
                    ) from fault
                time.sleep(_pause_s(len(faults), fault))
            else:
                self._is_down.clear()
                return content, tuple(faults)

    def close(self) -> None:
        """Close all connections."""
        self._wire.close()

    def _send_once(self, request: Mapping[str, Any]) -> bytes:
        try:
            return self._wire.post(request)
        except TimeoutError as error:
            timeout_s = self._options.timeout_s
            raise _TransientError(
                f"does not answer within {timeout_s:g} s", "raise timeout_s if it is slow"
            ) from error
        except UnreadableError as error:
            raise ModelError(f"{self.where} {error}; is it a chat model's address?") from error
        except openai.APIConnectionError as error:
            reason = self._secret.redact(in_one_line(error.__cause__ or error))
            raise _TransientError(f"cannot be reached ({reason})", "is the server up?") from error
        except openai.APIStatusError as error:
            raise self._classify(error) from error
        except openai.OpenAIError as error:
            reason = self._secret.redact(in_one_line(error))
            raise ModelError(
                f"{self.where} cannot be asked ({reason}); check base_url and model"
            ) from error

    def _classify(self, error: openai.APIStatusError) -> _TransientError | ModelError:
        status = error.status_code
        body = error.response.content
        phrase = f" {HTTPStatus(status).phrase}" if status in set(HTTPStatus) else ""
        problem = f"answers {status}{phrase}: {self._quote(body)}"
        hint = (
            _hint_of(body) or _HINTS.get(status) or _HINTS.get(status // 100 * 100) or _OTHER_HINT
        )
        is_transient = status in _TRANSIENT or status >= 500
        if not is_transient or (status == 429 and _QUOTA_EXCEEDED in body):
            return ModelError(f"{self.where} {problem}; {hint}")
        wait_s = _retry_after_s(error.response.headers)
        if wait_s is not None and wait_s > _LONGEST_RETRY_AFTER_S:
            return ModelError(
                f"{self.where} {problem}, and asks to wait {wait_s:.0f} s; run the same command "
                "again then: it resumes"
            )
        return _TransientError(problem, hint, wait_s, busy=status == 429)

    def _quote(self, body: bytes) -> str:
        text = self._secret.redact(body.decode("utf-8", "replace"))
        short = " ".join(text.split())[:_QUOTED]
        return repr(short) if short else "nothing"


def _hint_of(body: bytes) -> str | None:
    """Return the hint to a refusal that servers have words of their own for; None for others."""
    if b"may be provided in one prompt" in body:  # vLLM
        return (
            "start the server with a higher --limit-mm-per-prompt '{\"image\": N}', or use fewer "
            "frames"
        )
    return None


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
