"""Requests over HTTP, without redirects, limited in bytes and in time."""

import asyncio
import logging
from collections.abc import Callable, Mapping
from concurrent.futures import CancelledError
from dataclasses import dataclass, field
from pathlib import Path
from threading import Thread
from typing import Any
from urllib.parse import urlsplit

import httpx2

from infthor_eval.errors import UsageError, wrap_errors
from model_adapters.addresses import is_local
from model_adapters.served.options import ServedOptions

_LARGEST = 4 * 2**20  # bytes of the largest accepted reply
_CONNECT_S = 30.0  # limit for a connection
# The last three are of addresses that are none: of a proxy, or given by a server.
_NO_CONNECTION = (httpx2.HTTPError, httpx2.InvalidURL, UnicodeError, ExceptionGroup)
# They log headers of replies, in which a server may repeat the key.
_LOGGERS = ("httpcore2", "httpx2")


class UnreadableError(Exception):
    """A reply that is not read to its end; the message says why."""


class UnreachableError(Exception):
    """No connection, or one that breaks; the message says why."""


class StatusError(Exception):
    """A reply with a status that is no success.

    Attributes:
        status: the status.
        content: the reply's body.
        headers: the reply's headers, with names in lower case.
    """

    def __init__(self, status: int, content: bytes, headers: Mapping[str, str]) -> None:
        super().__init__(status)
        self.status = status
        self.content = content
        self.headers = headers


@dataclass(frozen=True, kw_only=True)
class Call:
    """A request.

    Attributes:
        path: path below the server's address, with its query; or a whole address.
        method: method of HTTP.
        content: body, or a file with it.
        headers: headers beside those of every request.
        form: fields of a form before the file that it uploads, instead of a body.
        largest: bytes of the largest accepted reply; None for that of one reply in words.
        timeout_s: limit for the whole reply; None for that of one reply in words.
        failure: returns the error in a body that came with the status of a success, if it has one.
    """

    path: str
    method: str = "POST"
    content: bytes | Path = b""
    headers: Mapping[str, str] = field(default_factory=dict)
    form: Mapping[str, str] | None = None
    largest: int | None = None
    timeout_s: float | None = None
    failure: Callable[[bytes], StatusError | None] = lambda _: None


@dataclass(frozen=True)
class Answer:
    """The body of a reply, and its headers, with names in lower case."""

    content: bytes
    headers: Mapping[str, str]


class Wire:
    """Sends requests to one server, from any number of threads.

    All requests run in the event loop of one background thread. There a request can be cancelled at
    any moment, also during a name lookup or while headers or body arrive slowly; timeouts of
    sockets cover only single reads.
    """

    def __init__(self, options: ServedOptions, headers: Mapping[str, str]) -> None:
        """Take the options, and the headers of every request."""
        problem = "ALL_PROXY, HTTPS_PROXY, HTTP_PROXY or NO_PROXY cannot be used"
        hint = "name a proxy as http://HOST:PORT, or unset them"
        broken = (ImportError, ValueError, httpx2.InvalidURL)  # socks5:// needs one more library
        with wrap_errors(problem, hint, catch=broken, raise_as=UsageError):
            self._client = _client(options, headers)
        self._url = options.url
        self._timeout_s = options.timeout_s
        self._closed = False
        for name in _LOGGERS:
            logging.getLogger(name).setLevel(logging.WARNING)
        self._loop = asyncio.new_event_loop()
        self._thread = Thread(target=self._loop.run_forever, name="served", daemon=True)
        self._thread.start()

    def send(self, call: Call) -> Answer:
        """Return the server's reply to a request.

        Raises:
            UnreachableError: no connection, or one that breaks.
            StatusError: the status is no success.
            TimeoutError: no complete reply in time.
            UnreadableError: the reply is too long or encoded, or the client is closed.
        """
        if self._closed:
            raise UnreadableError("gets no more requests: the model is closed")
        future = asyncio.run_coroutine_threadsafe(self._send(call), self._loop)
        try:
            return future.result()
        except CancelledError as error:
            raise UnreadableError("is no longer waited for: the model is closed") from error
        except _NO_CONNECTION as error:
            raise UnreachableError(str(error.__cause__ or error) or type(error).__name__) from error
        finally:
            future.cancel()  # has an effect if the waiting thread was interrupted

    async def _send(self, call: Call) -> Answer:
        largest = _LARGEST if call.largest is None else call.largest
        async with (
            asyncio.timeout(self._timeout_s if call.timeout_s is None else call.timeout_s),
            self._client.stream(
                call.method,
                f"{self._url}{call.path}" if call.path.startswith("/") else call.path,
                headers=dict(call.headers),
                **_body(call),
            ) as response,
        ):
            content = await _read(response, largest)
        headers = {name.lower(): value for name, value in response.headers.items()}
        if not response.is_success:
            raise StatusError(response.status_code, content, headers)
        return Answer(content, headers)

    def close(self) -> None:
        """Cancel all requests and close all connections."""
        self._closed = True
        asyncio.run_coroutine_threadsafe(self._cancel_all(), self._loop).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    async def _cancel_all(self) -> None:
        in_flight = asyncio.all_tasks() - {asyncio.current_task()}
        for task in in_flight:
            task.cancel()
        await asyncio.gather(*in_flight, return_exceptions=True)
        await self._client.aclose()


def _client(options: ServedOptions, headers: Mapping[str, str]) -> httpx2.AsyncClient:
    # A local server is asked without the proxy of the environment, which may be on another machine.
    return httpx2.AsyncClient(
        headers={"Accept-Encoding": "identity", **headers},
        timeout=httpx2.Timeout(None, connect=min(_CONNECT_S, options.timeout_s)),
        limits=httpx2.Limits(max_connections=None, max_keepalive_connections=options.max_in_flight),
        follow_redirects=False,
        trust_env=not is_local(urlsplit(options.url)),
    )


def _body(call: Call) -> dict[str, Any]:
    """Return the body of a request as the client takes it; a file is read when it is sent."""
    if call.form is not None:
        assert isinstance(call.content, Path)
        fields = {name: (None, value) for name, value in call.form.items()}
        return {"files": {**fields, "file": (call.content.name, call.content.read_bytes())}}
    if isinstance(call.content, Path):
        return {"content": call.content.read_bytes()}
    return {"content": call.content} if call.content else {}


async def _read(response: httpx2.Response, largest: int) -> bytes:
    """Return a reply's body; compressed ones, which may expand to any length, are refused."""
    if response.headers.get("Content-Encoding", "identity").strip().lower() not in ("", "identity"):
        raise UnreadableError("answers in an encoding that was not requested")
    content = bytearray()
    async for piece in response.aiter_raw():
        content += piece
        if len(content) > largest:
            raise UnreadableError(f"answers more than {largest} bytes")
    return bytes(content)
