"""ai2thor's FIFO server, safe against a simulator that dies, hangs or breaks the protocol.

The original server opens its pipes with blocking calls and reads without watching the child
process, so it waits for ever for a simulator that died. This one opens the pipes non-blocking,
watches the child while it waits, and raises a `PeerFault` that says what failed.

The objects, which are most of a reply, are `ReceivedObjects`, and decoded while the simulator is at
work: it draws its frames after it has told them.
"""

import contextlib
import fcntl
import io
import os
import select
import struct
import subprocess
import time
from collections import defaultdict
from typing import Any

import msgspec
from ai2thor.fifo_server import FieldType, FifoServer
from ai2thor.server import DepthFormat, MultiAgentEvent, read_buffer_image

from infthor_eval.errors import SimulatorError
from infthor_eval.storage.scratch import ScratchFolder
from infthor_eval.thor.view import ReceivedObjects

_WATCH_SECONDS = 0.1  # interval at which a waiting read or write checks the child process
# A frame with ids and depth has 0.9 MB; the default of 64 KiB would cost many wake-ups.
_PIPE_BYTES = 1 << 20
_LARGEST_BODY = 1 << 30
_NOT_PROTOCOL = (
    KeyError,
    TypeError,
    ValueError,
    AttributeError,
    IndexError,
)  # msgspec's errors are ValueErrors
_decode = msgspec.msgpack.decode
_IDS = "image_ids"
_KEPT: dict[str, type] = {"objects": ReceivedObjects, "colors": msgspec.Raw}


class PeerFault(SimulatorError):
    """The simulator's process failed; `fault_type` is "died", "hung" or "garbage"."""

    def __init__(self, fault_type: str, message: str) -> None:
        super().__init__(message)
        self.fault_type = fault_type


class SafeFifoServer(FifoServer):
    """A drop-in replacement of ai2thor's FIFO server, whose events have no masks of objects.

    Instead they have `colors`, those of what each pixel of `instance_segmentation_frame` shows, in
    MessagePack: masks take a tenth of the time of a reply, and hardly anybody asks for them.

    Attributes:
        fault: the failure, after which the server cannot be used again; None before.
        current_action: name of the action in progress, for messages.
    """

    raw_metadata: Any
    raw_files: Any
    server_pipe: Any
    client_pipe: Any
    tmp_dir: Any

    def __init__(
        self,
        width: int,
        height: int,
        timeout: float | None = 100.0,
        depth_format: DepthFormat = DepthFormat.Meters,
        add_depth_noise: bool = False,
    ) -> None:
        super().__init__(width, height, timeout, depth_format, add_depth_noise)
        # In place of ai2thor's own folder, which would stay for ever after a SIGKILL.
        self.tmp_dir.cleanup()
        self.tmp_dir = ScratchFolder()
        self.server_pipe_path = str(self.tmp_dir.path / "server.pipe")
        self.client_pipe_path = str(self.tmp_dir.path / "client.pipe")
        self.fault: PeerFault | None = None
        self.current_action = "starting"
        self._deadline = float("inf")
        self._seconds = 0.0
        self._connected = False  # True once the simulator has sent something
        self._is_drawn = True  # whether the next reply has frames

    def receive(self, timeout: float | None = None) -> MultiAgentEvent:
        """Wait for one reply.

        Args:
            timeout: time limit of the whole reply in seconds; None is the server's own limit.

        Raises:
            PeerFault: the simulator died, hung, or sent something that is not its protocol.
        """
        try:
            reply = super().receive(timeout)
            for event in reply.events:
                # Each holds itself in here, so that only the collector could free it: a third of
                # a replay's time.
                event.events = []
            return reply
        except PeerFault:
            raise
        except _NOT_PROTOCOL as error:
            detail = " ".join(f"{type(error).__name__}: {error}".split())[:200]
            raise self._fail("garbage", f"sent what is not its protocol ({detail})") from error

    def create_event(self, metadata: dict[str, Any], files: Any) -> Any:
        """Return the event of a reply."""
        agents = metadata["agents"]
        plain = {**metadata, "agents": [{**agent, "colors": None} for agent in agents]}
        reply = super().create_event(plain, {it: files[it] for it in files if it != _IDS})
        for event, agent in zip(reply.events, agents, strict=True):
            event.colors = agent.get("colors", msgspec.Raw())
        for event, ids in zip(reply.events, files.get(_IDS, ()), strict=False):
            frame = read_buffer_image(ids, event.screen_width, event.screen_height)
            event.instance_segmentation_frame = frame[:, :, :3]
        return reply

    def send(self, action: dict[str, Any]) -> None:
        """Send one action; raises PeerFault if the simulator died or does not read."""
        self.current_action = str(action.get("action"))
        self._is_drawn = bool(action.get("renderImage", True))
        super().send(action)
        self._decode_objects()  # of the last reply

    def stop(self) -> None:
        """Kill and reap the simulator, and remove its pipes. Calling it again does nothing."""
        process = self.unity_proc
        if process is not None and process.poll() is None:
            process.kill()
            process.wait()
        for pipe in (self.server_pipe, self.client_pipe):
            if pipe is not None:
                pipe.close()
        self.raw_metadata = self.raw_files = self.last_event = None
        self.tmp_dir.cleanup()

    def _recv_message(self, timeout: float | None) -> tuple[Any, Any]:
        self._start_clock(timeout)
        if self.server_pipe is None:
            self.server_pipe = _open_pipe(self.server_pipe_path, os.O_RDONLY)
        metadata: dict[str, Any] | None = None
        files: Any = defaultdict(list)
        while True:
            header = self._read_with_timeout(self.server_pipe, self.header_size, timeout)
            if header[0] == FieldType.END_OF_MESSAGE.value:
                break
            number, length = struct.unpack(self.header_format, header)
            field = self.field_types[number]
            body = self._read_with_timeout(self.server_pipe, length, timeout)
            if field is FieldType.METADATA:
                parts = _decode(body, type=dict[str, msgspec.Raw])
                agents = _decode(parts.pop("agents"), type=list[dict[str, msgspec.Raw]])
                metadata = {**_decoded(parts), "agents": [_decoded(agent) for agent in agents]}
                self.raw_metadata = metadata
                if self._is_drawn:
                    self._decode_objects()
            elif field is FieldType.METADATA_PATCH:  # what a query changes of the reply before
                patch = _decoded(_decode(body, type=dict[str, msgspec.Raw]))
                active = patch["agentId"]
                agents = [dict(agent) for agent in self.raw_metadata["agents"]]
                agents[active].update(patch)
                metadata = {
                    "agents": agents,
                    "thirdPartyCameras": self.raw_metadata["thirdPartyCameras"],
                    "sequenceId": self.sequence_id,
                    "activeAgentId": active,
                }
                files = self.raw_files
            else:
                files[self.form_field_map[field]].append(body)
        self.raw_metadata, self.raw_files = metadata, files
        return metadata, files

    def _decode_objects(self) -> None:
        """Decode the objects that were received last, while the simulator acts or draws."""
        for agent in (self.raw_metadata or {}).get("agents", ()):
            if "objects" in agent:
                agent["objects"].decode()

    def _send_message(self, message_type: FieldType, body: bytes) -> None:
        self._start_clock(None)
        if self.client_pipe is None:
            self.client_pipe = self._open_client_pipe()
        self._last_action_message = body
        self._write(memoryview(self._create_header(message_type, body) + body + self.eom_header))

    def _read_with_timeout(
        self,
        server_pipe: io.FileIO,
        message_size: int,
        timeout: float | None,  # unused: `_start_clock` sets the deadline of the whole reply
    ) -> bytearray:
        """Read exactly `message_size` bytes."""
        if message_size > _LARGEST_BODY:
            raise self._fail("garbage", f"announced a message part of {message_size} bytes")
        body = bytearray(message_size)
        rest = memoryview(body)
        while rest:
            count = self._read_some(server_pipe.fileno(), rest)
            rest = rest[count:]
        return body

    def _read_some(self, descriptor: int, into: memoryview) -> int:
        """Read what is available, at least one byte."""
        while True:
            try:
                count = os.readv(descriptor, [into])
            except BlockingIOError:
                count = -1
            if count > 0:
                self._connected = True
                return count
            if count == 0 and self._connected:
                # End of file: the simulator closed its end.
                raise self._fail("died", self._exit_message())
            # No writer yet (0), or nothing to read (-1). Without a writer `select` would return at
            # once, so sleep.
            self._check()
            if count == 0:
                time.sleep(0.005)
            else:
                select.select([descriptor], [], [], _WATCH_SECONDS)

    def _write(self, rest: memoryview) -> None:
        descriptor = self.client_pipe.fileno()
        while rest:
            try:
                rest = rest[os.write(descriptor, rest) :]
            except BlockingIOError:
                self._check()
                select.select([], [descriptor], [], _WATCH_SECONDS)
            except BrokenPipeError as error:
                raise self._fail("died", self._exit_message()) from error

    def _open_client_pipe(self) -> io.FileIO:
        """Open the pipe to the simulator as soon as it has opened its end."""
        while True:
            try:
                return _open_pipe(self.client_pipe_path, os.O_WRONLY)
            except OSError:  # ENXIO: the simulator has not opened it for reading yet
                self._check()
                time.sleep(0.005)

    def _start_clock(self, timeout: float | None) -> None:
        seconds = self.timeout if timeout is None else timeout
        self._seconds = float("inf") if seconds is None else seconds
        self._deadline = time.monotonic() + self._seconds

    def _check(self) -> None:
        """Raise if the process has ended or the time limit has passed."""
        if self.unity_proc is not None and self.unity_proc.poll() is not None:
            raise self._fail("died", self._exit_message())
        if time.monotonic() > self._deadline:
            raise self._fail("hung", f"gave no answer within {self._seconds:g} s")

    def _exit_message(self) -> str:
        if self.unity_proc is None:
            return "closed its pipe"
        try:
            # Pipes close a moment before the process can be reaped.
            code = self.unity_proc.wait(timeout=1.0)
        except subprocess.TimeoutExpired:
            return "closed its pipe while still running"
        return f"died (exit status {code})"

    def _fail(self, fault_type: str, message: str) -> PeerFault:
        self.fault = PeerFault(fault_type, f"the simulator {message} at {self.current_action}")
        return self.fault


def _decoded(parts: dict[str, msgspec.Raw]) -> dict[str, Any]:
    """Return the parts of a message decoded, but those that may not be asked for."""
    return {key: _KEPT[key](raw) if key in _KEPT else _decode(raw) for key, raw in parts.items()}


def _open_pipe(path: str, mode: int) -> io.FileIO:
    descriptor = os.open(path, mode | os.O_NONBLOCK | os.O_CLOEXEC)
    with contextlib.suppress(OSError):  # systems may limit the size; a smaller pipe only costs time
        fcntl.fcntl(descriptor, fcntl.F_SETPIPE_SZ, _PIPE_BYTES)
    return io.FileIO(descriptor, "rb" if mode == os.O_RDONLY else "wb")
