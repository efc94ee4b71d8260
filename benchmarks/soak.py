"""Check that long runs with injected faults have the same results as undisturbed runs.

    python benchmarks/soak.py --questions SET --trajectories DIR [--data FOLDER] [--n-questions
    2000]
        [--n-episodes 300] [--every 20] [--out DIR]

Two workers ask questions of a server in this script, whose replies depend only on the request. Two
workers with their simulators run pick-ups of planner-arm. Each is run twice: undisturbed in one
process, and disturbed. The faults alternate: a worker is killed; a simulator is killed; the whole
run is killed and the last line of a shard is cut in the middle; the whole run is killed and a line
is garbled (--recover); the server answers 500 or 429, stalls, or breaks the connection.
"""

import argparse
import hashlib
import itertools
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Lock, Thread
from typing import Any

from infthor_eval.formats.trajectory import iter_sources
from infthor_eval.manipulation.kinds import ManipulationKind
from infthor_eval.manipulation.trajectories import arm_episodes

_STALL_S = 4.0  # longer than the model's timeout_s
_SERVER_FAULTS = ("500", "stall", "429", "reset")


def main() -> None:
    """Run everything undisturbed and disturbed, and print the comparison."""
    options = _arguments()
    with tempfile.TemporaryDirectory() as scratch:
        out = options.out or Path(scratch)
        out.mkdir(parents=True, exist_ok=True)
        with _Server(options.every) as server:
            model = (
                f"base_url={server.url},model=m,timeout_s={_STALL_S / 2},retries=8,max_in_flight=1"
            )
            words = [
                "--model",
                "openai",
                "--model-args",
                model,
                "--tasks",
                "nieh_gt",
                "--data",
                str(options.questions),
            ]
            words += ["--limit", str(options.n_questions)]
            soak("questions", words, ("worker", "cut", "worker", "garble"), out, options, server)
        pick_ups = out / "trajectories.jsonl"
        pick_ups.write_bytes(b"".join(_with_pick_ups(options.trajectories, options.n_episodes)))
        words = [
            "--model",
            "planner-arm",
            "--tasks",
            "manipulathor_pickup",
            "--data",
            str(pick_ups),
        ]
        words += ["--limit", str(options.n_episodes)] + (
            ["--scenes", str(options.data)] if options.data else []
        )
        soak("episodes", words, ("simulator", "worker", "simulator", "cut"), out, options)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--questions", type=Path, required=True, help="an NIEH set")
    parser.add_argument(
        "--trajectories", type=Path, required=True, help="folder of generated trajectories"
    )
    parser.add_argument("--data", type=Path, help="folder of recorded floor plans")
    parser.add_argument("--n-questions", type=int, default=2000)
    parser.add_argument("--n-episodes", type=int, default=300)
    parser.add_argument(
        "--every", type=int, default=20, help="units, and requests, between two faults"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, help="folder of the results; default: temporary")
    return parser.parse_args()


def _with_pick_ups(folder: Path, n: int) -> Iterator[bytes]:
    n_found = 0
    for source in iter_sources(folder):
        if n_found >= n:
            return
        n_found += sum(
            episode.kind is ManipulationKind.PICKUP for episode in arm_episodes(source.read())
        )
        yield source.raw.replace(b"\n", b" ").strip() + b"\n"


def soak(
    name: str,
    words: Sequence[str],
    faults: Sequence[str],
    out: Path,
    options: argparse.Namespace,
    server: "_Server | None" = None,
) -> None:
    """Run the same work twice, and print whether the results are equal."""
    began = time.monotonic()
    calm = _Run([*words, "--out", str(out / name / "calm")], out / name / "calm")
    calm.start()
    calm.wait()
    calm_seconds, began = time.monotonic() - began, time.monotonic()
    if server is not None:
        server.disturbing = True
    harsh = _Run(
        [*words, "--workers", "2", "--out", str(out / name / "harsh")], out / name / "harsh"
    )
    injected = _run_disturbed(
        harsh, itertools.cycle(faults), options.every, random.Random(options.seed)
    )
    if server is not None:
        injected += server.injected
    one, other = calm.units(), harsh.units()
    equal = sum(_plain(one[key]) == _plain(other.get(key, {})) for key in one)
    n_recorded = sum(len(record.get("faults", ())) for record in other.values())
    failed = [sum("failure" in record for record in units.values()) for units in (one, other)]
    print(
        f"{name}: {len(one)} and {len(other)} units, {equal} equal; results "
        f"{'equal' if calm.summary() == harsh.summary() else 'DIFFER'}; failed {failed[0]} and "
        f"{failed[1]}; faults injected {dict(sorted(injected.items()))}, {n_recorded} recorded; "
        f"{calm_seconds:.0f} s undisturbed, {time.monotonic() - began:.0f} s disturbed",
        flush=True,
    )


def _plain(record: dict[str, Any]) -> dict[str, Any]:
    """Return what must be equal: all fields but times, attempts, faults and cached tokens."""
    return {
        name: value
        for name, value in record.items()
        if name not in ("seconds", "attempt", "faults", "tokens")
    }


def _run_disturbed(
    run: "_Run", faults: Iterator[str], every: int, draw: random.Random
) -> Counter[str]:
    """Finish a run with a fault every `every` units; returns the injected faults."""
    injected: Counter[str] = Counter()
    threshold = every
    run.start()
    while run.goes_on():
        if run.n_units() < threshold:
            time.sleep(0.05)
            continue
        threshold += every
        fault = next(faults)
        injected[fault] += _inject(fault, run, draw)
    return injected


def _inject(fault: str, run: "_Run", draw: random.Random) -> bool:
    """Inject a fault; returns False if there is nothing to kill."""
    if fault in ("worker", "simulator"):
        return run.kill(fault, draw)
    run.kill_all()
    (run.cut if fault == "cut" else run.garble)(draw)
    run.start("--recover" if fault == "garble" else None)
    return True


@dataclass
class _Run:
    """A run of our command."""

    words: Sequence[str]
    output: Path
    process: "subprocess.Popen[bytes] | None" = field(default=None)

    def start(self, more: str | None = None) -> None:
        command = [
            Path(sys.executable).with_name("infthor-eval"),
            "run",
            *self.words,
            *([more] if more else []),
        ]
        self.output.mkdir(parents=True, exist_ok=True)
        with (self.output / "output.txt").open("ab") as log:
            self.process = subprocess.Popen(list(map(str, command)), stdout=log, stderr=log)

    def wait(self) -> None:
        assert self.process is not None
        self.process.wait()
        self._require_end()

    def goes_on(self) -> bool:
        assert self.process is not None
        if self.process.poll() is None:
            return True
        self._require_end()
        return False

    def _require_end(self) -> None:
        assert self.process is not None
        if self.process.returncode not in (0, 1):
            raise SystemExit(
                f"{' '.join(self.words)} ended with {self.process.returncode}: see "
                f"{self.output}/output.txt"
            )

    def shards(self) -> list[Path]:
        return [path for path in self.output.rglob("journal/worker-*.jsonl") if path.stat().st_size]

    def n_units(self) -> int:
        return sum(path.read_bytes().count(b'"type":"unit"') for path in self.shards())

    def units(self) -> dict[tuple[str, str, str], dict[str, Any]]:
        """Return the last record of each unit."""
        units: dict[tuple[str, str, str], dict[str, Any]] = {}
        for path in self.shards():
            for line in path.read_bytes().splitlines():
                record = json.loads(line)
                key = (record.get("task", ""), record.get("id", ""), record.get("variant", ""))
                if record["type"] == "unit" and record.get("attempt", 1) >= units.get(key, {}).get(
                    "attempt", 1
                ):
                    units[key] = record
        return units

    def summary(self) -> Any:
        (path,) = self.output.rglob("results.json")
        document = json.loads(path.read_text())
        return document["summary"], document["n_missing"]

    def kill(self, kind: str, draw: random.Random) -> bool:
        """Kill a worker of the run, or a simulator."""
        assert self.process is not None
        mark = {"worker": b"multiprocessing.spawn", "simulator": b"infthor_sim"}[kind]
        pids = [pid for pid in _descendants(self.process.pid) if mark in _command(pid)]
        if not pids:
            return False
        _kill(draw.choice(sorted(pids)))
        return True

    def kill_all(self) -> None:
        """Kill the driver, and wait until the processes that it started have ended."""
        assert self.process is not None
        below = _descendants(self.process.pid)
        self.process.kill()
        self.process.wait()
        deadline = time.monotonic() + 60
        while any(Path(f"/proc/{pid}").exists() for pid in below):
            if time.monotonic() > deadline:
                raise SystemExit(f"processes {below} did not end with their driver")
            time.sleep(0.05)

    def cut(self, draw: random.Random) -> None:
        """Cut the last line of a shard in the middle."""
        path = draw.choice(sorted(self.shards()))
        content = path.read_bytes()
        last = content.rstrip(b"\n").rpartition(b"\n")[2]
        if content.count(b"\n") > 1:
            path.write_bytes(content[: len(content) - 1 - len(last) // 2])

    def garble(self, draw: random.Random) -> None:
        """Overwrite some bytes in the middle of a line of a shard."""
        path = draw.choice(sorted(self.shards()))
        lines = path.read_bytes().splitlines(keepends=True)
        number = draw.randrange(1, len(lines)) if len(lines) > 1 else 0
        lines[number] = lines[number][:20] + b"\x00\xff\x00" + lines[number][23:]
        path.write_bytes(b"".join(lines))


def _descendants(pid: int) -> list[int]:
    children: dict[int, list[int]] = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(path.read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue  # the process has ended
        children.setdefault(parent, []).append(int(path.parent.name))
    descendants, waiting = [], [pid]
    while waiting:
        below = children.get(waiting.pop(), [])
        descendants += below
        waiting += below
    return descendants


def _command(pid: int) -> bytes:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ")
    except OSError:
        return b""  # the process has ended


def _kill(pid: int) -> None:
    try:
        os.kill(pid, signal.SIGKILL)
    except ProcessLookupError:
        return  # the process has ended


class _Listener(ThreadingHTTPServer):
    """A server that does not report clients that were killed before they got their reply."""

    daemon_threads = True

    def handle_error(self, request: Any, client_address: Any) -> None:
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class _Server:
    """A server of chat completions that depend only on the request; if `disturbing`, some requests
    fail."""

    def __init__(self, every: int) -> None:
        self.disturbing = False
        self.injected: Counter[str] = Counter()
        self._every, self._n, self._lock = every, 0, Lock()
        server = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["Content-Length"]))
                server.answer(self, body)

            def log_message(self, *_: Any) -> None:
                pass

        self._http = _Listener(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self._http.server_address[1]}/v1"

    def __enter__(self) -> "_Server":
        Thread(target=self._http.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._http.shutdown()
        self._http.server_close()

    def answer(self, handler: BaseHTTPRequestHandler, body: bytes) -> None:
        fault = self._fault()
        if fault == "stall":
            time.sleep(_STALL_S)
        if fault in ("reset", "stall"):
            handler.close_connection = True
            return
        if fault is not None:
            self._send(handler, int(fault), {"error": {"message": "injected"}})
            return
        drawn = hashlib.sha256(body).digest()
        text = ("yes", "no", "Fridge", "CounterTop", "2", "Mug")[drawn[0] % 6]
        choice = {
            "index": 0,
            "message": {"role": "assistant", "content": text},
            "finish_reason": "stop",
        }
        usage = {
            "prompt_tokens": len(body) // 1000,
            "completion_tokens": 2,
            "total_tokens": len(body) // 1000 + 2,
        }
        reply = {"id": "c", "object": "chat.completion", "created": 0, "model": "m"}
        self._send(handler, 200, reply | {"choices": [choice], "usage": usage})

    def _fault(self) -> str | None:
        with self._lock:
            self._n += 1
            if not self.disturbing or self._n % self._every:
                return None
            fault = _SERVER_FAULTS[self._n // self._every % len(_SERVER_FAULTS)]
            self.injected[f"server {fault}"] += 1
            return fault

    def _send(self, handler: BaseHTTPRequestHandler, status: int, document: dict[str, Any]) -> None:
        content = json.dumps(document).encode()
        handler.send_response(status)
        handler.send_header("Content-Type", "application/json")
        handler.send_header("Content-Length", str(len(content)))
        handler.end_headers()
        handler.wfile.write(content)


if __name__ == "__main__":
    main()
