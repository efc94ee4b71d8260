"""The adapter `openpi`: policies behind openpi's server.

Its own client, openpi-client, needs a numpy below 2 and cannot be installed here, so msgpack writes
what goes over the wire. The wire has no episodes: the server is told of no beginning and no end.
"""

from typing import Any

import msgpack
import numpy as np

from infthor_eval.storage.digests import digest
from model_adapters.options.policies import OpenPiOptions
from model_adapters.protocols import ArmObservation
from model_adapters.remote_policies.actions import convention_of, state_vector
from model_adapters.remote_policies.sessions import RemotePolicy, Session

_ARRAY = b"__ndarray__"


class OpenPiSession(Session):
    """A connection to openpi's server, which sends its metadata first."""

    _options: OpenPiOptions

    def _greet(self) -> None:
        self.greeting = {"metadata": digest(pack(self._receive())), "episodes": "none"}
        self.convention = convention_of(self.server, {}, self._options)

    def _ask(self, observation: ArmObservation, instruction: str) -> dict[Any, Any]:
        options = self._options
        request: dict[str, Any] = {
            options.image_key: np.asarray(observation.image.load()),
            options.prompt_key: instruction,
        }
        if observation.wrist is not None:
            request[options.wrist_key] = np.asarray(observation.wrist.load())
        if observation.state is not None:
            form = options.state_format
            request[options.state_key] = state_vector(observation.state, form)
        self._send(pack(request))
        answer: dict[Any, Any] = self._receive()
        return answer

    def _unpack(self, content: bytes) -> Any:
        answer = unpack(content)
        if not isinstance(answer, dict):
            raise TypeError(f"{type(answer).__name__} instead of a map")
        return answer


class OpenPi(RemotePolicy):
    """The adapter `openpi`."""

    Options = OpenPiOptions
    session = OpenPiSession


def pack(value: Any) -> bytes:
    """Return a value as openpi's servers read it."""
    content: bytes = msgpack.packb(value, default=_to_map)
    return content


def unpack(content: bytes) -> Any:
    """Return the value in a message; a damaged one raises one of `DAMAGED` (`sessions.py`)."""
    return msgpack.unpackb(content, object_hook=_from_map)


def _to_map(value: Any) -> Any:
    if not isinstance(value, np.ndarray):
        return value
    said = {b"dtype": value.dtype.str, b"shape": value.shape}
    return {_ARRAY: True, b"data": value.tobytes()} | said


def _from_map(value: dict[Any, Any]) -> Any:
    if b"__npgeneric__" in value:
        return value[b"data"]
    if _ARRAY not in value:
        return value
    dtype = np.dtype(str(value[b"dtype"]))
    if dtype.kind not in "biuf":  # others could run code when they are created
        raise ValueError(f"an array of {dtype}")
    return np.frombuffer(value[b"data"], dtype).reshape(value[b"shape"])
