"""Servers of others, for benchmarks."""

import os
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path

from tiny_families.trial import torchvision_path

__all__ = ["Served", "serve_transformers", "serve_vllm"]

_START_S = 600


@dataclass
class Served:
    """A server.

    Attributes:
        url: its address without `/chat/completions`.
        processor_seconds: processor time that it took with its children, once it has ended.
    """

    url: str
    processor_seconds: float = 0.0


def serve_vllm(
    checkpoint: Path, dtype: str, environment: Mapping[str, str], most_frames: int
) -> AbstractContextManager[Served]:
    """Serve a checkpoint in vLLM on a CPU within the context; requests have at most so many
    frames."""
    options = [
        "--model",
        str(checkpoint),
        "--dtype",
        dtype,
        "--enforce-eager",
        "--max-model-len",
        "16384",
    ]
    options += ["--limit-mm-per-prompt", f'{{"image": {most_frames}, "video": 0}}']
    options += ["--mm-processor-kwargs", '{"use_fast": false}', "--enable-prompt-tokens-details"]
    return _serve(["-m", "vllm.entrypoints.openai.api_server", *options], environment)


def serve_transformers(
    dtype: str, environment: Mapping[str, str]
) -> AbstractContextManager[Served]:
    """Serve whatever checkpoints are asked for in transformers on a CPU within the context."""
    server = str(Path(__file__).with_name("transformers_server.py"))
    words = [server, "serve", "--device", "cpu", "--dtype", dtype]
    return _serve(words, {**environment, **torchvision_path()})


@contextmanager
def _serve(arguments: Sequence[str], environment: Mapping[str, str]) -> Iterator[Served]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, *arguments, "--host", "127.0.0.1", "--port", str(port)]
    served = Served(f"http://127.0.0.1:{port}/v1")
    with tempfile.TemporaryFile() as said:
        server = subprocess.Popen(command, stdout=said, stderr=said, env=dict(environment))
        try:
            _wait(f"http://127.0.0.1:{port}/health", server)
            yield served
        finally:
            server.terminate()
            _, status, usage = os.wait4(server.pid, 0)
            server.returncode = os.waitstatus_to_exitcode(status)
            served.processor_seconds = usage.ru_utime + usage.ru_stime


def _wait(url: str, server: "subprocess.Popen[bytes]") -> None:
    end = time.monotonic() + _START_S
    while time.monotonic() < end and server.poll() is None:
        try:
            with urllib.request.urlopen(url, timeout=60):
                return
        except (urllib.error.URLError, ConnectionError):
            time.sleep(0.2)
    sys.exit("the server does not come up")
