"""Servers that tests start, and the records of runs behind them and in this process."""

import socket
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from infthor_eval.runs import UnitRecord

from ..helpers.command_line import CliRunner, option_words
from ..helpers.journals import read_records

__all__ = ["free_port", "run_each", "wait_for_server"]

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


def run_each(
    run_cli: CliRunner, output: Path, models: Mapping[str, Mapping[str, object]], *words: object
) -> list[list[UnitRecord[Any]]]:
    """Run the same tasks with each model and its options; gives the records of each."""
    records = []
    for model, settings in models.items():
        options = ",".join(f"{name}={value}" for name, value in settings.items())
        typed = option_words(model=model, model_args=options, name=model, out=output)
        code, _, error_text = run_cli(*typed, *words)
        assert code == 0, error_text
        records.append(read_records(output / model))
    return records
