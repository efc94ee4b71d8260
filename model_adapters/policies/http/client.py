"""A client that posts JSON, with retries and one-line errors."""

import http.client
import json
import time
import urllib.error
import urllib.request
from typing import Any

from infthor_eval.errors import ModelError, in_one_line
from infthor_eval.storage.deadlines import limit_time

_LARGEST = 16 * 2**20  # bytes of the largest accepted reply
_PIECE = 2**16
_FIRST_WAIT_S = 0.5  # pause before the second attempt; it doubles before each further one
_QUOTED = 200  # characters of a server's text in a message


class _NoRedirect(urllib.request.HTTPRedirectHandler):
    """Redirects are errors: followed, a POST would become a GET without its content."""

    def redirect_request(self, *args: Any, **kwargs: Any) -> None:
        return None


class JsonClient:
    """Posts JSON to one address, http or https.

    A whole reply may take `timeout_s` seconds; a failed connection is tried again `retries` times.
    """

    def __init__(self, url: str, *, timeout_s: float, retries: int) -> None:
        self._url = url
        self._timeout_s = timeout_s
        self._retries = retries
        self._opener = urllib.request.build_opener(_NoRedirect)

    def post(self, content: object) -> Any:
        """Return the server's reply to a POST request, as JSON values.

        Raises:
            ModelError: no connection, no reply in time, an error status, or a reply that is not
                JSON.
        """
        body = json.dumps(content).encode()
        reply = self._send(body)
        try:
            return json.loads(reply)
        except (ValueError, RecursionError) as error:
            raise ModelError(
                f"{self._url} answers with something that is not JSON: {_quote(reply)}; is it a "
                "policy's address?"
            ) from error

    def _send(self, body: bytes) -> bytes:
        # Only a failed connection is retried: an error status would come again, and a late reply
        # may still be computed.
        reason: Exception | None = None
        for attempt in range(self._retries + 1):
            if attempt:
                time.sleep(_FIRST_WAIT_S * 2 ** (attempt - 1))
            try:
                return self._send_once(body)
            except (urllib.error.URLError, ConnectionError, http.client.HTTPException) as error:
                reason = error
        cause = in_one_line(getattr(reason, "reason", None) or reason or ConnectionError())
        raise ModelError(
            f"{self._url} cannot be reached in {self._retries + 1} attempts ({cause}); is the "
            "server up?"
        )

    def _send_once(self, body: bytes) -> bytes:
        # Of the whole request: a socket's timeout begins again with each byte that arrives.
        with limit_time(self._timeout_s, self._timeout_error()):
            return self._exchange(body)

    def _exchange(self, body: bytes) -> bytes:
        request = urllib.request.Request(self._url, body, {"Content-Type": "application/json"})
        try:
            with self._opener.open(request, timeout=self._timeout_s) as reply:
                return self._read(reply)
        except urllib.error.HTTPError as error:
            with error:
                text = _quote(error.read(_QUOTED))
            raise ModelError(f"{self._url} answers {error.code} {error.reason}: {text}") from error
        except urllib.error.URLError as error:
            if isinstance(error.reason, TimeoutError):
                raise self._timeout_error() from error
            raise
        except TimeoutError as error:
            raise self._timeout_error() from error

    def _read(self, reply: http.client.HTTPResponse) -> bytes:
        """Read the whole reply."""
        content = b""
        while piece := reply.read1(_PIECE):
            content += piece
            if len(content) > _LARGEST:
                raise ModelError(
                    f"{self._url} answers more than {_LARGEST} bytes; is it a policy's?"
                )
        if reply.length:  # bytes of the announced length that are missing
            raise http.client.IncompleteRead(content, reply.length)
        return content

    def _timeout_error(self) -> ModelError:
        return ModelError(
            f"{self._url} does not answer within {self._timeout_s:g} s; raise timeout_s if it is "
            "slow"
        )


def _quote(content: bytes) -> str:
    text = " ".join(content[:_QUOTED].decode("utf-8", "replace").split())
    return repr(text) if text else "nothing"
