"""Asking a server until it answers: what passes is waited for, what does not is told in one line."""

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
from model_adapters.openai.rate import RateLimiter
from model_adapters.openai.secret import Secret
from model_adapters.openai.wire import UnreadableError, Wire

__all__ = ["Endpoint"]

_FIRST_WAIT_S = 0.5  # before the second attempt; doubled before each further one
_LONGEST_WAIT_S = 60.0
_LONGEST_ASKED_S = 600.0  # that a server may ask to wait
_QUOTED = 200  # characters of what a server says
_PASSING = (408, 409, 425, 429)  # and all of the server's own, from 500 on
_SPENT = b"insufficient_quota"  # with 429 where waiting does not help
_MENDS = {
    300: "redirects are not followed: give the address that it leads to as base_url",
    401: "set the environment variable that api_key_env names to a key that it takes",
    402: "see your account with it",
    403: "set the environment variable that api_key_env names to a key that may ask this model",
    404: "check base_url (it ends before /chat/completions) and model",
    413: "show fewer frames, or use image_format=jpeg",
    429: "lower max_in_flight, or set requests_per_minute and tokens_per_minute",
    500: "see its log",
}
_OTHER_MEND = "check model and the options that are sent (send_seed, send_temperature, send_stop, max_tokens_field)"


class _PassingError(Exception):
    """What may be over when the request is sent again.

    Attributes:
        mend: what to do where it is not.
        wait_s: how long the server asks to wait; None where it does not say.
        busy: whether the server is well, and only has too much to do.
    """

    def __init__(self, said: str, mend: str, wait_s: float | None = None, *, busy: bool = False) -> None:
        super().__init__(said)
        self.mend = mend
        self.wait_s = wait_s
        self.busy = busy


class Endpoint:
    """One server, asked from any number of threads.

    Where a request failed for good, though it was sent again and again, the next ones are sent once only until one of
    them is answered: a server that is down is not waited for by every unit of a run.

    Args:
        options: how it is asked.
        secret: the key.
    """

    def __init__(self, options: OpenAIOptions, secret: Secret) -> None:
        self.where = options.url
        self._options = options
        self._secret = secret
        self._wire = Wire(options, secret)
        self._requests = RateLimiter(options.requests_per_minute)
        self._given_up = Event()

    def ask(self, request: Mapping[str, Any]) -> tuple[bytes, tuple[str, ...]]:
        """What the server answers, and what went wrong on the way, a line each.

        Args:
            request: the fields of a chat completion.

        Raises:
            ModelError: it does not answer, or with an error.
        """
        faults: list[str] = []
        most = 1 if self._given_up.is_set() else 1 + self._options.retries
        while True:
            self._requests.wait()
            try:
                content = self._asked_once(request)
            except _PassingError as fault:
                faults.append(f"{self.where} {fault}")
                if len(faults) == most:
                    if not fault.busy:
                        self._given_up.set()
                    raise ModelError(f"{self.where} {fault}, in {most} attempts; {fault.mend}") from fault
                time.sleep(_wait_s(len(faults), fault))
            else:
                self._given_up.clear()
                return content, tuple(faults)

    def close(self) -> None:
        """Close all connections."""
        self._wire.close()

    def _asked_once(self, request: Mapping[str, Any]) -> bytes:
        try:
            return self._wire.post(request)
        except TimeoutError as error:
            timeout_s = self._options.timeout_s
            raise _PassingError(f"does not answer within {timeout_s:g} s", "raise timeout_s if it is slow") from error
        except UnreadableError as error:
            raise ModelError(f"{self.where} {error}; is it a chat model's address?") from error
        except openai.APIConnectionError as error:
            said = self._secret.hidden_in(in_one_line(error.__cause__ or error))
            raise _PassingError(f"cannot be reached ({said})", "is the server up?") from error
        except openai.APIStatusError as error:
            raise self._judged(error) from error
        except openai.OpenAIError as error:
            said = self._secret.hidden_in(in_one_line(error))
            raise ModelError(f"{self.where} cannot be asked ({said}); check base_url and model") from error

    def _judged(self, error: openai.APIStatusError) -> _PassingError | ModelError:
        status, body = error.status_code, error.response.content
        said = f"answers {status}{_phrase(status)}: {self._quoted(body)}"
        mend = _MENDS.get(status) or _MENDS.get(status // 100 * 100) or _OTHER_MEND
        passing = status in _PASSING or status >= 500
        if not passing or (status == 429 and _SPENT in body):
            return ModelError(f"{self.where} {said}; {mend}")
        wait_s = _asked_wait_s(error.response.headers)
        if wait_s is not None and wait_s > _LONGEST_ASKED_S:
            return ModelError(
                f"{self.where} {said}, and asks to wait {wait_s:.0f} s; run the same command again then, "
                "which goes on where it was"
            )
        return _PassingError(said, mend, wait_s, busy=status == 429)

    def _quoted(self, body: bytes) -> str:
        text = self._secret.hidden_in(body.decode("utf-8", "replace"))
        short = " ".join(text.split())[:_QUOTED]
        return repr(short) if short else "nothing"


def _phrase(status: int) -> str:
    return f" {HTTPStatus(status).phrase}" if status in set(HTTPStatus) else ""


def _wait_s(n_faults: int, fault: _PassingError) -> float:
    """Before the next attempt: as the server asks, or longer each time, and not all threads at once."""
    waited = min(_FIRST_WAIT_S * 2 ** (n_faults - 1), _LONGEST_WAIT_S) * (1 + random.random() / 4)
    return waited if fault.wait_s is None else fault.wait_s + random.random() * _FIRST_WAIT_S


def _asked_wait_s(headers: Mapping[str, str]) -> float | None:
    """How long a server asks to wait, in seconds from now; None where it does not say, or nothing that can be read."""
    try:
        if "retry-after-ms" in headers:
            return max(0.0, float(headers["retry-after-ms"]) / 1000)
        asked = headers.get("retry-after", "")
        return max(0.0, float(asked)) if asked.replace(".", "", 1).isdecimal() else _until(asked)
    except (ValueError, OverflowError):
        return None


def _until(date: str) -> float:
    return max(0.0, email.utils.parsedate_to_datetime(date).timestamp() - time.time())
