"""One request to a server, and what can go wrong with it."""

import http.client
import json
import time
import urllib.error
import urllib.request
from typing import Any

from infthor_eval.errors import ModelError, in_one_line

__all__ = ["JsonClient"]

_LARGEST = 16 * 2**20  # bytes of a reply
_PIECE = 2**16
_FIRST_WAIT_S = 0.5  # before the second attempt; doubled before each further one
_QUOTED = 200  # characters of what a server says


class _NoRedirect(urllib.request.HTTPRedirectHandler):
    """Redirects are errors: followed, a POST would become a GET without its content."""

    def redirect_request(self, *args: Any, **kwargs: Any) -> None:
        return None


class JsonClient:
    """Posts JSON to one address.

    Args:
        url: of http or https.
        timeout_s: for a whole reply.
        retries: how often a request is sent again where the connection failed.
    """

    def __init__(self, url: str, *, timeout_s: float, retries: int) -> None:
        self._url = url
        self._timeout_s = timeout_s
        self._retries = retries
        self._opener = urllib.request.build_opener(_NoRedirect)

    def post(self, content: object) -> Any:
        """What the server answers, as JSON values.

        Raises:
            ModelError: no connection, no reply in time, an error status, or a reply that is no JSON.
        """
        body = json.dumps(content).encode()
        reply = self._sent(body)
        try:
            return json.loads(reply)
        except (ValueError, RecursionError) as error:
            raise ModelError(f"{self._url} answers what is no JSON: {_quoted(reply)}; is it a policy's?") from error

    def _sent(self, body: bytes) -> bytes:
        reason: Exception | None = None
        for attempt in range(self._retries + 1):
            if attempt:
                time.sleep(_FIRST_WAIT_S * 2 ** (attempt - 1))
            try:
                return self._sent_once(body)
            except (urllib.error.URLError, ConnectionError, http.client.HTTPException) as error:
                reason = error
        said = in_one_line(getattr(reason, "reason", None) or reason or ConnectionError())
        raise ModelError(f"{self._url} cannot be reached in {self._retries + 1} attempts ({said}); is the server up?")

    def _sent_once(self, body: bytes) -> bytes:
        request = urllib.request.Request(self._url, body, {"Content-Type": "application/json"})
        try:
            with self._opener.open(request, timeout=self._timeout_s) as reply:
                return self._read(reply)
        except urllib.error.HTTPError as error:
            with error:
                said = _quoted(error.read(_QUOTED))
            raise ModelError(f"{self._url} answers {error.code} {error.reason}: {said}") from error
        except urllib.error.URLError as error:
            if isinstance(error.reason, TimeoutError):
                raise self._late() from error
            raise
        except TimeoutError as error:
            raise self._late() from error

    def _read(self, reply: http.client.HTTPResponse) -> bytes:
        """The whole reply; the time-out of a socket is one of each piece alone."""
        content, end = b"", time.monotonic() + self._timeout_s
        while piece := reply.read1(_PIECE):
            content += piece
            if time.monotonic() > end:
                raise self._late()
            if len(content) > _LARGEST:
                raise ModelError(f"{self._url} answers more than {_LARGEST} bytes; is it a policy's?")
        if reply.length:  # of what was announced, so much is missing
            raise http.client.IncompleteRead(content, reply.length)
        return content

    def _late(self) -> ModelError:
        return ModelError(f"{self._url} does not answer within {self._timeout_s:g} s; raise timeout_s if it is slow")


def _quoted(content: bytes) -> str:
    text = " ".join(content[:_QUOTED].decode("utf-8", "replace").split())
    return repr(text) if text else "nothing"
