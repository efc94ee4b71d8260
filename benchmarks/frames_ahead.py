"""Frames a second that are read and scaled, and how long a model waits for them.

The way before (transformers' own image processor in the model's thread) and the present one take
turns, so that the speed of the machine cancels out; each has a process, because the present one
changes how memory is kept. The model is a null model: it sleeps as long as a GPU would compute.
Reading, digests and sizes are part of the time. The model is idle whenever it does not sleep, and
waits for frames from when it asks for one until it has it.

    python benchmarks/frames_ahead.py
    python benchmarks/frames_ahead.py --models smolvlm2 --frames 60
    python benchmarks/frames_ahead.py --torchvision     # as if torchvision were installed
"""

import argparse
import json
import os
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import cache
from importlib.util import find_spec
from multiprocessing import get_context
from pathlib import Path
from statistics import median
from typing import Any, cast

import torch
import transformers
from rich.console import Console
from rich.table import Table
from tiny_families.trial import PEERS, torchvision_path

from infthor_eval.cli.main import collecting_seldom
from infthor_eval.formats.frames import FrameRef
from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.packed.paths import SetPath
from infthor_eval.storage.folders import packaged_folder
from model_adapters.hf.family import Pixels
from model_adapters.hf.loading.image_processors import load_image_processor
from model_adapters.hf.prompting.ahead import Ahead, PixelsAhead
from model_adapters.hf.prompting.prompt import Clip, Frame
from model_adapters.options.checkpoints import FrameScaling

__all__ = ["main"]

_CHUNK_TOKENS = 1024  # the default of a model's option
_BEFORE = "before, singly"


@dataclass(frozen=True)
class _Case:
    """A model's image processor, by the settings of its published checkpoint.

    Attributes:
        settings: those that matter for time.
        tokens: tokens of a frame of 300x300.
        null_rate: frames a second of the null model.
        share: the frames of the others for one of this.
    """

    settings: dict[str, Any]
    tokens: int
    null_rate: int
    share: int = 1


_CASES = {
    "qwen2.5-vl": _Case(
        {
            "image_processor_type": "Qwen2VLImageProcessor",
            "size": {"shortest_edge": 3136, "longest_edge": 12845056},
        },
        tokens=121,
        null_rate=400,
    ),
    "llava-onevision": _Case(
        {"image_processor_type": "LlavaOnevisionImageProcessor"}, tokens=1485, null_rate=150
    ),
    "smolvlm2": _Case(
        {
            "image_processor_type": "SmolVLMImageProcessor",
            "size": {"longest_edge": 2048},
            "max_image_size": {"longest_edge": 512},
        },
        tokens=1228,
        null_rate=10,
        share=30,
    ),
}


@dataclass(frozen=True)
class _Way:
    """A way to prepare frames.

    Attributes:
        backend: what scales them: transformers (its own class for PIL), pil or torchvision.
        n_threads: threads ahead of the model.
        batch: frames that are scaled together.
    """

    backend: str
    n_threads: int = 0
    batch: int = 1


@dataclass
class _Turns:
    """What the turns of a way took: seconds, seconds of processor time, and seconds in which the
    model waited for frames that it had asked for, of each."""

    wall: list[float] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)
    waited: list[float] = field(default_factory=list)


def main() -> None:
    """Print frames a second and shares of waiting, for each model."""
    options = _read_options()
    if options.torchvision:
        _start_again_with_torchvision()
    ways = _ways(options.threads)
    console = Console(width=110)
    with ExitStack() as stack:
        processes = {
            backend: stack.enter_context(ProcessPoolExecutor(1, get_context("spawn")))
            for backend in dict.fromkeys(way.backend for way in ways.values())
        }
        for name in options.models.split(","):
            case = _CASES[name]
            rate = options.null_rate or case.null_rate
            for table, null_rate in ((_rate_table, None), (_idle_table, rate)):
                n_frames = max(8, options.frames // case.share)
                turns: dict[str, _Turns] = {title: _Turns() for title in ways}
                for turn in range(options.repeat + 1):
                    for title, way in ways.items():
                        work = processes[way.backend].submit(_feed, name, way, n_frames, null_rate)
                        wall, cpu, waited = work.result()
                        if turn:  # the first one warms up
                            turns[title].wall.append(wall)
                            turns[title].cpu.append(cpu)
                            turns[title].waited.append(waited)
                console.print(table(name, n_frames, rate, turns))


def _read_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--models", default=",".join(_CASES), help="separated by commas")
    parser.add_argument("--frames", type=int, default=600, help="of SmolVLM2 a thirtieth")
    parser.add_argument("--threads", type=int, default=os.cpu_count(), help="ahead of the model")
    parser.add_argument("--repeat", type=int, default=3, help="turns of each way")
    parser.add_argument("--null-rate", type=int, help="frames a second of the null model")
    parser.add_argument(
        "--torchvision", action="store_true", help="have torchvision, as `make test` sets it aside"
    )
    return parser.parse_args()


def _start_again_with_torchvision() -> None:
    if not PEERS.is_dir():
        sys.exit(f"{PEERS}: no torchvision; run `make test` once, which puts it there")
    words = [word for word in sys.argv if word != "--torchvision"]
    os.execve(sys.executable, [sys.executable, *words], os.environ | torchvision_path())


def _ways(n_threads: int) -> dict[str, _Way]:
    ways = {
        "before, batches of 8": _Way("transformers", batch=8),
        _BEFORE: _Way("transformers"),
        "now, no thread": _Way("pil"),
        f"now, {n_threads} threads ahead": _Way("pil", n_threads),
    }
    if find_spec("torchvision") is not None:
        ways["torchvision, no thread"] = _Way("torchvision")
        ways[f"torchvision, {n_threads} threads ahead"] = _Way("torchvision", n_threads)
    return ways


@cache
def _image_processor(name: str, backend: str) -> Any:
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "preprocessor_config.json").write_text(json.dumps(_CASES[name].settings))
        if backend == "transformers":
            auto = cast(Any, transformers).AutoImageProcessor
            return auto.from_pretrained(folder, backend="pil")
        return load_image_processor(Path(folder), FrameScaling(image_backend=backend))


@collecting_seldom()  # as the command does
def _feed(name: str, way: _Way, n_frames: int, null_rate: int | None) -> tuple[float, float, float]:
    """Prepare frames in chunks, and compute on each in between, at the null model's rate or in no
    time; return seconds of it all, seconds of processor time, and seconds of waiting for frames."""
    torch.set_num_threads(1)
    process = _image_processor(name, way.backend)

    def prepare(piece: Frame | Clip) -> Pixels:
        assert isinstance(piece, Frame)
        pixels: Pixels = process(images=[piece.ref.load()], return_tensors="pt")
        return pixels

    data = NiehSet(packaged_folder("sets/nieh_mini"))
    names = sorted({question.traj_id for question in data.questions})
    paths = [frame.path for name in names for frame in data.frames(name)][:n_frames]
    per_chunk = max(way.batch, _CHUNK_TOKENS // _CASES[name].tokens)
    ahead = PixelsAhead(prepare, Ahead(way.n_threads))
    try:
        start, start_cpu = time.perf_counter(), time.process_time()
        frames = _frames(paths)
        ahead.expect(frames)
        waited = 0.0
        for at in range(0, n_frames, per_chunk):
            chunk = frames[at : at + per_chunk]
            asked = time.perf_counter()
            if way.batch > 1:
                process(images=[frame.ref.load() for frame in chunk], return_tensors="pt")
            else:
                for frame in chunk:
                    ahead.take(frame)
            waited += time.perf_counter() - asked
            if null_rate is not None:
                time.sleep(len(chunk) / null_rate)
        return time.perf_counter() - start, time.process_time() - start_cpu, waited
    finally:
        ahead.close()


def _frames(paths: Sequence[SetPath]) -> list[Frame]:
    """Return frames as a prompt has them: their digests and sizes are read anew."""
    refs = [FrameRef(path) for path in paths]
    return [Frame(f"{at}{ref.digest}", ref.size, (), ref) for at, ref in enumerate(refs)]


def _rate_table(name: str, n_frames: int, _: int, turns: dict[str, _Turns]) -> Table:
    table = Table(f"{name}, {n_frames} frames")
    for head in ("frames/s", "least", "most", "times before", "CPU ms a frame", "times less"):
        table.add_column(head)
    before = turns[_BEFORE]
    for title, took in turns.items():
        rates = [n_frames / wall for wall in took.wall]
        table.add_row(
            title,
            *(f"{each(rates):.1f}" for each in (median, min, max)),
            f"{_ratio(before.wall, took.wall):.2f}",
            f"{1e3 * median(took.cpu) / n_frames:.2f}",
            f"{_ratio(before.cpu, took.cpu):.2f}",
        )
    return table


def _idle_table(name: str, n_frames: int, rate: int, turns: dict[str, _Turns]) -> Table:
    table = Table(f"{name}, {n_frames} frames, null model of {rate} frames/s")
    for head in ("idle (% of the time)", "least", "most", "waits for frames (%)"):
        table.add_column(head)
    for title, took in turns.items():
        idle = [100 * (1 - n_frames / rate / wall) for wall in took.wall]
        waits = [100 * waited / wall for waited, wall in zip(took.waited, took.wall, strict=True)]
        cells = [*(each(idle) for each in (median, min, max)), median(waits)]
        table.add_row(title, *(f"{cell:.1f}" for cell in cells))
    return table


def _ratio(before: Sequence[float], now: Sequence[float]) -> float:
    return median([old / new for old, new in zip(before, now, strict=True)])


if __name__ == "__main__":
    main()
