"""The shim that makes calls of a process fail: compiled, told what is to fail, and read."""

import ctypes
import mmap
import os
import shutil
import subprocess
from enum import IntEnum
from pathlib import Path

__all__ = ["CallKind", "Control", "Fault", "NoCompilerError", "compile_shim"]

_SOURCE = Path(__file__).with_name("shim.c")
_VARIABLE = "FAULT_CONTROL"  # names the mapped file to the shim
_MOST_CALLS = 65536
_LONGEST = 1024


class NoCompilerError(Exception):
    """There is no C compiler."""


class CallKind(IntEnum):
    """What a call does; the values of `enum kind` in shim.c."""

    CREATE = 1
    WRITE = 2
    RENAME = 3
    SYNC = 4
    DELETE = 5
    TRUNCATE = 6


class Fault(IntEnum):
    """What happens at a call; the values of `enum fault` in shim.c."""

    KILL = 1  # SIGKILL before it
    TORN = 2  # half of it is written, then SIGKILL
    FULL = 3  # ENOSPC, there and from then on
    ERROR = 4  # EIO, there alone
    SHORT = 5  # half of it is written, without an error
    INODES = 6  # ENOSPC of what creates a file, there and from then on
    READ_ONLY = 7  # EROFS, there and from then on
    STALE = 8  # it is done, and reports ESTALE
    PAUSE = 9  # SIGSTOP before it, so that another process comes between
    CLOCK_BACK = 10  # a day earlier from then on
    CLOCK_FORWARD = 11

    def suits(self, kind: CallKind) -> bool:
        """Return whether it can happen at a call of this kind, and is not that of the next one."""
        kinds = _KINDS.get(self)
        return kinds is None or kind in kinds


_NEED_ROOM = (CallKind.CREATE, CallKind.WRITE, CallKind.SYNC)
_KINDS = {
    Fault.TORN: (CallKind.WRITE,),
    Fault.FULL: _NEED_ROOM,
    Fault.SHORT: (CallKind.WRITE,),
    Fault.INODES: (CallKind.CREATE,),
    Fault.STALE: (CallKind.RENAME,),
}


class _Layout(ctypes.Structure):
    _fields_ = (
        ("folder", ctypes.c_char * _LONGEST),
        ("process", ctypes.c_int64),
        ("at", ctypes.c_int64),
        ("fault", ctypes.c_int64),
        ("counted", ctypes.c_int64),
        ("call", ctypes.c_char * _LONGEST),
        ("kinds", ctypes.c_ubyte * _MOST_CALLS),
    )


def compile_shim(folder: Path) -> Path:
    """Compile the shim into a folder, and return its file.

    Raises:
        NoCompilerError: there is no `cc`, or it cannot compile the shim.
    """
    compiler = shutil.which("cc")
    if compiler is None:
        raise NoCompilerError("no C compiler (cc) is installed, which makes the calls fail")
    library = folder / "shim.so"
    words = [compiler, "-O2", "-shared", "-fPIC", "-o", library, _SOURCE, "-ldl"]
    made = subprocess.run(words, capture_output=True, text=True, check=False)
    if made.returncode:
        raise NoCompilerError(f"cc cannot compile {_SOURCE.name}: {made.stderr.strip()[:300]}")
    return library


class Control:
    """The mapped file between this process and the shim."""

    def __init__(self, path: Path) -> None:
        """Create the file, or map it if it exists."""
        size = ctypes.sizeof(_Layout)
        with path.open("a+b") as file:
            file.truncate(size)
            self._mapped = _Layout.from_buffer(mmap.mmap(file.fileno(), size))

    @staticmethod
    def environment(library: Path, path: Path) -> dict[str, str]:
        """Return the environment of a process in which the shim is loaded."""
        return os.environ | {"LD_PRELOAD": str(library), _VARIABLE: str(path)}

    @staticmethod
    def is_in_environment() -> bool:
        """Return whether the shim is loaded into this process."""
        return _VARIABLE in os.environ

    @staticmethod
    def leave_environment() -> Path:
        """Keep the shim from the processes that this one starts; returns the mapped file."""
        os.environ.pop("LD_PRELOAD")
        return Path(os.environ.pop(_VARIABLE))

    def watch(self, folder: Path, fault: Fault | None = None, at: int = 0) -> None:
        """Count the calls of this process below a folder; the fault comes at the call `at`."""
        self._mapped.folder = str(folder).encode()
        self._mapped.at = at
        self._mapped.fault = fault or 0
        self._mapped.counted = 0
        self._mapped.call = b""
        self._mapped.process = os.getpid()

    def calls(self) -> list[CallKind]:
        """Return the calls that were counted."""
        if self._mapped.counted > _MOST_CALLS:
            raise ValueError(f"{self._mapped.counted} calls are too many; make the run smaller")
        return [CallKind(kind) for kind in self._mapped.kinds[: self._mapped.counted]]

    @property
    def failed_call(self) -> str:
        """Name and path of the call that failed; empty if it was not reached."""
        return self._mapped.call.decode(errors="replace")
