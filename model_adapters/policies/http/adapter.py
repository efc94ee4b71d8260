"""The adapter `vla-http`: any policy behind a server.

Arrays are in JSON as by the package json_numpy, which servers of the `/act` convention expect.
"""

import base64
import binascii
import http.client
import json
import time
import urllib.error
import urllib.request
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt

from infthor_eval.errors import ModelError, in_one_line
from infthor_eval.formats.frames import FrameRef
from infthor_eval.storage.deadlines import limit_time
from model_adapters.addresses import act_url
from model_adapters.options.policies import VlaHttpOptions
from model_adapters.policies.policy import arm_deltas
from model_adapters.protocols import ArmDelta, Capabilities

_MARK = "__numpy__"
_KINDS = "fiu"  # numbers only: object arrays could run code when they are created
_LARGEST = 16 * 2**20  # bytes of the largest accepted reply
_PIECE = 2**16
_FIRST_WAIT_S = 0.5  # pause before the second attempt; it doubles before each further one
_QUOTED = 200  # characters of a server's text in a message


class HttpPolicy:
    """The adapter `vla-http`: a policy behind a server."""

    Options: ClassVar[type] = VlaHttpOptions

    def __init__(self, name: str, options: VlaHttpOptions) -> None:
        self.name = name
        self._options = options
        self._url = act_url(options.url)
        self._client = _JsonClient(self._url, options)
        base = self._url.removesuffix("/act")
        self._resets = _JsonClient(base + options.reset, options) if options.reset else None
        self._begins = False

    @classmethod
    def build(cls, name: str, options: VlaHttpOptions, seed: int) -> Self:  # noqa: ARG003
        """Build the client; the first request is sent by `act`."""
        return cls(name, options)

    @property
    def capabilities(self) -> Capabilities:
        """No guarantees: the server is unknown."""
        return Capabilities(counts_tokens=False, token_ids=False, deterministic=False)

    def identity(self) -> dict[str, Any]:
        """Return address and form of requests, as JSON values; the policy is unknown."""
        options = self._options
        return {
            "adapter": self.name,
            "url": self._url,
            "unnorm_key": options.unnorm_key,
            "image": options.image,
            "execute": options.execute,
        } | ({} if options.reset is None else {"reset": options.reset})

    def reset(self) -> None:
        """Begin an episode: the server is told with the first frame, if it has an address for it;
        the convention has none."""
        self._begins = True

    def act(self, frame: FrameRef, instruction: str) -> tuple[ArmDelta, ...]:
        """Return the next steps; see `Policy.act`."""
        if self._begins and self._resets is not None:
            self._resets.send({"instruction": instruction})
        self._begins = False
        pixels = np.asarray(frame.load())
        request: dict[str, Any] = {
            "image": pixels.tolist() if self._options.image == "list" else encode_array(pixels),
            "instruction": instruction,
        }
        if self._options.unnorm_key is not None:
            request["unnorm_key"] = self._options.unnorm_key
        reply = self._client.post(request)
        try:
            numbers = decode_numbers(reply)
        except (ValueError, OverflowError) as error:
            raise ModelError(
                f"{self._url} answers without an action of numbers: {error}; see its log"
            ) from error
        actions = numbers[None] if numbers.ndim == 1 else numbers
        return arm_deltas(f"{self.name} ({self._url})", actions)[: self._options.execute]

    def close(self) -> None:
        """Do nothing: no connection is kept open."""


def encode_array(array: npt.NDArray[Any]) -> dict[str, Any]:
    """Return an array as JSON values: its bytes in base 64, its type and its shape."""
    content = np.ascontiguousarray(array)
    return {
        _MARK: base64.b64encode(content.tobytes()).decode("ascii"),
        "dtype": content.dtype.str,
        "shape": list(content.shape),
    }


def decode_numbers(value: Any) -> npt.NDArray[np.float64]:
    """Return the numbers in a reply's JSON: lists, arrays of json_numpy, lists of either, or a text
    with such JSON.

    Raises:
        ValueError: the value is anything else, or ragged.
    """
    if isinstance(value, str):  # the reply of some servers to encoded requests
        try:
            value = json.loads(value)
        except ValueError as error:
            raise ValueError(f"the text {value[:80]!r}") from error
    return np.array(_to_lists(value), dtype=np.float64)


def _to_lists(value: Any) -> Any:
    if isinstance(value, list):
        return [_to_lists(element) for element in value]
    if isinstance(value, dict) and _MARK in value:
        return _decode_array(value).tolist()
    if isinstance(value, int | float) and not isinstance(value, bool):
        return value
    raise ValueError(f"{type(value).__name__} {str(value)[:80]!r} among numbers")


def _decode_array(value: dict[str, Any]) -> npt.NDArray[Any]:
    try:
        dtype = np.dtype(str(value["dtype"]))
        if dtype.kind not in _KINDS:
            raise ValueError(f"an array of {dtype}")
        return np.frombuffer(base64.b64decode(value[_MARK], validate=True), dtype).reshape(
            value["shape"]
        )
    except (KeyError, TypeError, binascii.Error) as error:
        raise ValueError(f"a damaged array ({error})") from error


class _NoRedirect(urllib.request.HTTPRedirectHandler):
    """Redirects are errors: followed, a POST would become a GET without its content."""

    def redirect_request(self, *args: Any, **kwargs: Any) -> None:
        return None


class _JsonClient:
    """Posts JSON to one address, http or https.

    A whole reply may take `timeout_s` seconds; a failed connection is tried again `retries` times.
    """

    def __init__(self, url: str, options: VlaHttpOptions) -> None:
        self._url = url
        self._timeout_s = options.timeout_s
        self._retries = options.retries
        self._opener = urllib.request.build_opener(_NoRedirect)

    def post(self, content: object) -> Any:
        """Return the server's reply to a POST request, as JSON values."""
        reply = self.send(content)
        try:
            return json.loads(reply)
        except (ValueError, RecursionError) as error:
            raise ModelError(
                f"{self._url} answers with something that is not JSON: {_quote(reply)}; is it a "
                "policy's address?"
            ) from error

    def send(self, content: object) -> bytes:
        """Return the server's reply to a POST request, whatever it is."""
        # Only a failed connection is retried: an error status would come again, and a late reply
        # may still be computed.
        body = json.dumps(content).encode()
        reason: Exception | None = None
        for attempt in range(self._retries + 1):
            if attempt:
                time.sleep(_FIRST_WAIT_S * 2 ** (attempt - 1))
            try:
                # Of the whole request: a socket's timeout begins again with each byte that arrives.
                with limit_time(self._timeout_s, self._timeout_error()):
                    return self._exchange(body)
            except (urllib.error.URLError, ConnectionError, http.client.HTTPException) as error:
                reason = error
        cause = in_one_line(getattr(reason, "reason", None) or reason or ConnectionError())
        raise ModelError(
            f"{self._url} cannot be reached in {self._retries + 1} attempts ({cause}); is the "
            "server up?"
        )

    def _exchange(self, body: bytes) -> bytes:
        request = urllib.request.Request(self._url, body, {"Content-Type": "application/json"})
        try:
            with self._opener.open(request, timeout=self._timeout_s) as reply:
                return self._read(reply)
        except urllib.error.HTTPError as error:
            with error:
                text = _quote(error.read(_QUOTED))
            raise ModelError(f"{self._url} answers {error.code} {error.reason}: {text}") from error
        except (urllib.error.URLError, TimeoutError) as error:
            if isinstance(getattr(error, "reason", error), TimeoutError):
                raise self._timeout_error() from error
            raise

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
