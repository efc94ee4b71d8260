"""The simulator's side of ai2thor's FIFO transport: two named pipes, framed messages.

A frame is a header `!BI` (field type, length of the body) and a body; a message is frames and an
empty end frame.
"""

import errno
import fcntl
import json
import os
import select
import struct
import time
from collections.abc import Iterable
from enum import IntEnum
from pathlib import Path
from typing import Any

from infthor_sim.errors import SimulatorError

_HEADER = struct.Struct("!BI")
_ROOM = 1 << 20  # bytes; the most that Linux grants without privileges
_PAUSE = 0.01  # seconds between two attempts at a pipe that the other side has not opened yet


class FieldType(IntEnum):
    """The content of a frame; the numbers are ai2thor's."""

    METADATA = 1
    ACTION = 2
    RGB = 4
    DEPTH = 5
    NORMALS = 6
    CLASSES = 8
    IDS = 9
    THIRD_PARTY_RGB = 10
    METADATA_PATCH = 11
    THIRD_PARTY_DEPTH = 12
    THIRD_PARTY_NORMALS = 13
    THIRD_PARTY_IDS = 14
    THIRD_PARTY_CLASSES = 15
    END_OF_MESSAGE = 255


_END = _HEADER.pack(FieldType.END_OF_MESSAGE, 0)


class FifoPipes:
    """Sends states and receives actions over the pipes that the Controller created.

    Args:
        server_pipe: path of the pipe that states are written to.
        client_pipe: path of the pipe that actions are read from.
        controller: process id of the Controller, which is this process's parent as long as it
            lives. Asked here, the system would name another parent if it has died already.
    """

    def __init__(self, server_pipe: Path, client_pipe: Path, controller: int) -> None:
        self._controller = controller
        # Opened only after the first state is sent, as Unity does.
        self._client_path = client_pipe
        self._out = self._open_out(server_pipe)
        self._in: int | None = None

    def close(self) -> None:
        """Close both pipes."""
        os.close(self._out)
        if self._in is not None:
            os.close(self._in)

    def send(self, frames: Iterable[tuple[FieldType, bytes | memoryview]]) -> None:
        """Write one message of these frames, each as soon as it is there."""
        for field_type, body in frames:
            view = memoryview(body).cast("B")
            self._write(_HEADER.pack(field_type, len(view)))
            self._write(view)
        self._write(_END)

    def receive(self) -> dict[str, Any] | None:
        """Return the next action, or None when the Controller has closed the pipe."""
        if self._in is None:
            self._in = self._open_in()
            if self._in is None:
                return None
        action: dict[str, Any] | None = None
        while True:
            header = self._read(_HEADER.size)
            if header is None:
                return None
            field_type, length = _HEADER.unpack(header)
            body = self._read(length) if length else b""
            if body is None:
                return None
            if field_type == FieldType.END_OF_MESSAGE:
                break
            action = parse_action(field_type, body)
        if action is None:
            raise SimulatorError(
                "the controller sent a message without an action; it must be ai2thor 5.0.0's FIFO "
                "form"
            )
        return action

    def _open_out(self, path: Path) -> int:
        """Open the pipe of states when the controller reads from it."""
        # A blocking open would wait for ever for a controller that has died meanwhile. A
        # non-blocking one fails with ENXIO as long as nobody reads.
        while True:
            try:
                pipe = os.open(path, os.O_WRONLY | os.O_NONBLOCK)
            except OSError as error:
                if error.errno != errno.ENXIO:
                    raise SimulatorError(
                        f"{path}: the pipe of states cannot be opened ({error.strerror})"
                    ) from error
                if not self._controller_lives():
                    raise SimulatorError("the controller died before it opened its pipe") from error
                time.sleep(_PAUSE)
            else:
                os.set_blocking(pipe, True)
                _widen(pipe)
                return pipe

    def _open_in(self) -> int | None:
        """Open the pipe of actions once the controller writes to it; None if it dies before."""
        pipe = os.open(self._client_path, os.O_RDONLY | os.O_NONBLOCK)
        poll = select.poll()
        poll.register(pipe, select.POLLIN)
        while not poll.poll(_PAUSE * 1000):
            if not self._controller_lives():
                os.close(pipe)
                return None
        os.set_blocking(pipe, True)
        return pipe

    def _controller_lives(self) -> bool:
        return os.getppid() == self._controller  # an orphan is given another parent

    def _write(self, data: bytes | memoryview) -> None:
        view = memoryview(data)
        while view:  # a pipe takes only as much at once as its buffer has room for
            view = view[os.write(self._out, view) :]

    def _read(self, size: int) -> bytes | None:
        assert self._in is not None
        parts = []
        while size:
            part = os.read(self._in, size)
            if not part:
                return None
            parts.append(part)
            size -= len(part)
        return b"".join(parts)


def _widen(pipe: int) -> None:
    """Give a pipe room for a whole reply, so that its writer goes on while the reader reads."""
    try:
        fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, _ROOM)
    except PermissionError:
        # more than the system grants: the pipe stays as it is, which is slower and nothing else
        return


def parse_action(field_type: int, body: bytes) -> dict[str, Any]:
    """Return the action in the body of a frame."""
    if field_type != FieldType.ACTION:
        raise SimulatorError(
            f"the controller sent a frame of type {field_type} where an action (2) is expected"
        )
    try:
        action = json.loads(body)
        # halves of characters, which no reply could repeat, become "?"
        if b"\\u" in body or b"\xed" in body:
            action = json.loads(json.dumps(action, ensure_ascii=False).encode(errors="replace"))
    except (ValueError, RecursionError) as error:
        raise SimulatorError(f"the controller sent an action that is not JSON ({error})") from error
    if not isinstance(action, dict):
        raise SimulatorError("the controller sent an action that is not a JSON object")
    return action
