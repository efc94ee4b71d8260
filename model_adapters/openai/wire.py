"""Requests by the official client, without redirects, limited in bytes and in time."""

import asyncio
import logging
from collections.abc import AsyncIterator, Mapping
from concurrent.futures import CancelledError
from threading import Thread
from typing import Any
from urllib.parse import urlsplit

import httpx2
import openai

from model_adapters.addresses import is_local
from model_adapters.openai.options import OpenAIOptions
from model_adapters.openai.secret import Secret

__all__ = ["UnreadableError", "Wire"]

_LARGEST = 4 * 2**20  # bytes of the largest accepted reply
_CONNECT_S = 30.0  # limit for a connection
# They log headers of replies, in which a server may repeat the key.
_LOGGERS = ("httpcore2", "httpx2")


class UnreadableError(Exception):
    """A reply that is not read to its end; the message says why."""


class Wire:
    """Sends requests to one server, from any number of threads.

    All requests run in the event loop of one background thread. There a request can be cancelled at
    any moment, also during a name lookup or while headers or body arrive slowly; timeouts of
    sockets cover only single reads.
    """

    def __init__(self, options: OpenAIOptions, secret: Secret) -> None:
        self._timeout_s = options.timeout_s
        self._closed = False
        for name in _LOGGERS:
            logging.getLogger(name).setLevel(logging.WARNING)
        self._loop = asyncio.new_event_loop()
        self._thread = Thread(target=self._loop.run_forever, name="openai", daemon=True)
        self._thread.start()
        self._client = _client(options, secret)
        self._headers: dict[str, Any] = {"Accept-Encoding": "identity"}
        if secret.value is None:
            self._headers["Authorization"] = openai.Omit()

    def post(self, request: Mapping[str, Any]) -> bytes:
        """Return the body of the server's reply to a chat completion request.

        Raises:
            openai.OpenAIError: no connection, or an error status.
            TimeoutError: no complete reply in time.
            UnreadableError: the reply is too long or encoded, or the client is closed.
        """
        if self._closed:
            raise UnreadableError("gets no more requests: the model is closed")
        future = asyncio.run_coroutine_threadsafe(self._post(request), self._loop)
        try:
            return future.result()
        except CancelledError as error:
            raise UnreadableError("is no longer waited for: the model is closed") from error
        except openai.APIConnectionError as error:
            if isinstance(error.__cause__, UnreadableError):
                raise error.__cause__ from error
            raise
        finally:
            future.cancel()  # has an effect if the waiting thread was interrupted

    async def _post(self, request: Mapping[str, Any]) -> bytes:
        async with asyncio.timeout(self._timeout_s):
            reply = await self._client.chat.completions.with_raw_response.create(
                **request, extra_headers=self._headers
            )
            return bytes(reply.content)

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
        await self._client.close()


def _client(options: OpenAIOptions, secret: Secret) -> openai.AsyncOpenAI:
    # A local server is asked without the proxy of the environment, which may be on another machine.
    http = openai.DefaultAsyncHttpxClient(
        timeout=httpx2.Timeout(None, connect=min(_CONNECT_S, options.timeout_s)),
        limits=httpx2.Limits(max_connections=None, max_keepalive_connections=options.max_in_flight),
        follow_redirects=False,
        trust_env=not is_local(urlsplit(options.url)),
        event_hooks={"response": [_limit_body]},
    )
    return openai.AsyncOpenAI(
        base_url=options.url,
        api_key=secret.value or "none",
        max_retries=0,  # `Endpoint` retries, and records it
        timeout=httpx2.Timeout(None, connect=min(_CONNECT_S, options.timeout_s)),
        http_client=http,
    )


async def _limit_body(response: httpx2.Response) -> None:
    """Make reading fail beyond the largest body; compressed ones, which may expand to any length,
    are refused."""
    if response.headers.get("Content-Encoding", "identity").strip().lower() not in ("", "identity"):
        raise UnreadableError("answers in an encoding that was not requested")
    assert isinstance(response.stream, httpx2.AsyncByteStream)  # of an asynchronous client
    response.stream = _LimitedStream(response.stream)


class _LimitedStream(httpx2.AsyncByteStream):
    def __init__(self, stream: httpx2.AsyncByteStream) -> None:
        self._stream = stream

    async def __aiter__(self) -> AsyncIterator[bytes]:
        n_bytes = 0
        async for piece in self._stream:
            n_bytes += len(piece)
            if n_bytes > _LARGEST:
                raise UnreadableError(f"answers more than {_LARGEST} bytes")
            yield piece

    async def aclose(self) -> None:
        await self._stream.aclose()
