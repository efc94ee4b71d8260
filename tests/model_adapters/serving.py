"""Servers that tests start, and the records of runs behind them and in this process."""

import socket
import subprocess
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest

__all__ = ["free_port", "wait_for_server"]

START_S = 600


def free_port() -> int:
    """A port of this machine that nobody listens on."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port: int = free.getsockname()[1]
    return port


def wait_for_server(url: str, server: "subprocess.Popen[bytes]", log: Path) -> None:
    """Return once a server answers at an address; the test fails with the end of its log if it does
    not."""
    end = time.monotonic() + START_S
    while time.monotonic() < end and server.poll() is None:
        try:
            with urllib.request.urlopen(url, timeout=60):
                return
        except (urllib.error.URLError, ConnectionError):
            time.sleep(0.2)
    pytest.fail(f"the server does not come up: {log.read_text()[-2000:]}")
