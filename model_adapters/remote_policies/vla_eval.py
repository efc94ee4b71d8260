"""The adapter `vla-eval`: policies behind the model servers of the package vla-eval.

Messages are made and read by its own functions. Its client takes a late answer for the next one;
here an answer belongs to the request of its number.
"""

import time
from typing import Any

import msgspec
import numpy as np

from infthor_eval.errors import ModelError, wrap_errors
from model_adapters.options.policies import STATES, SocketPolicyOptions
from model_adapters.protocols import ArmObservation, Episode
from model_adapters.remote_policies.actions import Spec, convention_of, state_vector
from model_adapters.remote_policies.sessions import RemotePolicy, Session, import_extra

_IMAGE = "rgb_hwc_uint8"


class _Hello(msgspec.Struct, kw_only=True):
    harness_version: str
    protocol_version: int
    model_server: str
    action_spec: dict[str, Spec] = {}
    observation_spec: dict[str, Spec] = {}
    observation_params: dict[str, Any] = {}


class VlaEvalSession(Session):
    """A connection to a model server."""

    def __init__(self, name: str, options: SocketPolicyOptions) -> None:
        self._protocol = import_extra(name, "vla_eval.protocol.messages")
        self._seq = self._start = 0
        super().__init__(name, options)

    def begin(self, episode: Episode) -> None:
        """See `Session`; the server says nothing if it agrees."""
        super().begin(episode)
        self._n_observations = 0
        self._history = episode.history
        self._started = time.monotonic()
        task = {
            "name": episode.name,
            "task_description": episode.instruction,
            "max_steps": episode.max_steps,
        }
        self._start = self._tell("EPISODE_START", {"task": task, "mode": "sync"})

    def end(self, *, success: bool | None) -> None:
        """See `Session`; as in the package's own runner, each observation counts as a step."""
        super().end(success=success)
        seconds = time.monotonic() - self._started
        metrics = {} if success is None else {"success": success}
        said = {"metrics": metrics, "steps": self._n_observations}
        self._tell("EPISODE_END", said | {"elapsed_sec": seconds})

    def _greet(self) -> None:
        answer = self._answer("HELLO", "HELLO", self._protocol.make_hello_payload())
        problem = f"{self.server} greets unlike a server of vla-eval"
        broken = (msgspec.ValidationError, TypeError)  # TypeError: no values of JSON
        with wrap_errors(problem, "is it one?", catch=broken, raise_as=ModelError):
            hello = msgspec.convert(answer, _Hello)
            self.greeting = msgspec.json.decode(msgspec.json.encode(hello))
        if hello.protocol_version != self._protocol.PROTOCOL_VERSION:
            raise ModelError(
                f"{self.server} speaks version {hello.protocol_version} of the protocol, not "
                f"{self._protocol.PROTOCOL_VERSION}; install its vla-eval {hello.harness_version}"
            )
        self.convention = convention_of(self.server, hello.action_spec, self._options)
        self._read_wants(hello)

    def _read_wants(self, hello: _Hello) -> None:
        """Keep what the server is to be told beside the view and the instruction."""
        params = hello.observation_params
        spec = hello.observation_spec
        images = [key for key, part in spec.items() if part.format == _IMAGE]
        state = spec.get("state", spec.get("states"))
        known = {*images, "state", "states", "language"}
        needs = [f"{key} ({part.format})" for key, part in spec.items() if key not in known]
        needs += images[2:]
        declared = "raw" if state is None else state.format
        self._state_format = self._options.state_format or declared
        if self._state_format == "raw":
            self._state_format = STATES[0]
        if self._state_format not in STATES:
            needs.append(f"the hand's state as {declared}")
        if needs:
            given = "two images and a state (state_format=)"
            raise ModelError(f"{self.server} needs {', '.join(needs)}; it can be given {given}")
        self._needs_state = state is not None or bool(params.get("send_state"))
        has_wrist = len(images) > 1 or any("wrist" in key for key in images)
        self._needs_wrist = has_wrist or bool(params.get("send_wrist_image"))

    def _ask(self, observation: ArmObservation, instruction: str) -> dict[Any, Any]:
        missing = []
        if self._needs_wrist and observation.wrist is None:
            missing.append("--cameras front,wrist")
        if self._needs_state and observation.state is None:
            missing.append("--state")
        if missing:
            raise ModelError(f"{self.server} needs more than is given; add {' '.join(missing)}")
        # The view is first: many servers go by the order of images, not by their names.
        images = {"agentview": np.asarray(observation.image.load())}
        if observation.wrist is not None:
            images["wrist"] = np.asarray(observation.wrist.load())
        content: dict[str, Any] = {"images": images, "task_description": instruction}
        if observation.state is not None:  # servers read one key or the other
            vector = state_vector(observation.state, self._state_format)
            content |= {"states": vector, "state": vector}
        if self._history and not self._n_observations:  # as RoboMME of the package tells it
            history = [np.asarray(frame.load()) for frame in self._history]
            content["video_history"] = history
        self._n_observations += 1
        return self._answer("OBSERVATION", "ACTION", content)

    def _tell(self, kind: str, payload: dict[str, Any]) -> int:
        self._seq += 1
        message = self._protocol.Message(self._protocol.MessageType[kind], payload, self._seq)
        self._send(self._protocol.pack_message(message))
        return self._seq

    def _answer(self, kind: str, wanted: str, payload: dict[str, Any]) -> dict[Any, Any]:
        """Return the payload of the answer to a message.

        What has another number answers what was asked before, and is left out; only an error of
        the episode's start is told, as a start is not answered otherwise.
        """
        seq = self._tell(kind, payload)
        while True:
            message = self._receive()
            if message.type.name == "ERROR" and message.seq in (seq, self._start):
                raise ModelError(f"{self.server} fails: {message.payload.get('error')}")
            if message.seq == seq:
                break
        if message.type.name != wanted:
            raise ModelError(f"{self.server} answers {kind} with {message.type.name}; see its log")
        answer: dict[Any, Any] = message.payload
        return answer

    def _unpack(self, content: bytes) -> Any:
        message = self._protocol.unpack_message(content)
        if not isinstance(message.payload, dict):
            raise TypeError(f"a payload of {type(message.payload).__name__}")
        return message


class VlaEval(RemotePolicy):
    """The adapter `vla-eval`."""

    session = VlaEvalSession
