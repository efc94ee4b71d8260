"""Frames a second that are read and scaled, and how long a model waits for them.

The old way (transformers' own image processor in the model's thread) and the present one take turns
in one process, so that the speed of the machine cancels out. The model is a null model: it sleeps as
long as a GPU would compute. Reading, digests and sizes are part of the time.

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
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import torch
from rich.console import Console
from rich.table import Table
from tiny_families.trial import PEERS, torchvision_path

from infthor_eval.formats.frames import FrameRef
from infthor_eval.storage.folders import packaged_folder
from model_adapters.hf.family import Pixels
from model_adapters.hf.loading.image_processors import load_image_processor
from model_adapters.hf.prompting.ahead import Ahead, PixelsAhead
from model_adapters.hf.prompting.prompt import Clip, Frame
from model_adapters.options.checkpoints import FrameScaling

__all__ = ["main"]

_CHUNK_TOKENS = 1024  # the default of a model's option


@dataclass(frozen=True)
class _Case:
    """A model's image processor, by the settings of its published checkpoint.

    Attributes:
        settings: those that matter for time.
        tokens: tokens of a frame of 300x300.
        null_rate: frames a second of the null model.
    """

    settings: dict[str, Any]
    tokens: int
    null_rate: int


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
    ),
}


def main() -> None:
    """Print frames a second and shares of waiting, for each model."""
    options = _read_options()
    if options.torchvision:
        _start_again_with_torchvision()
    paths = sorted(packaged_folder("sets/nieh_mini").glob("metadata/*/img/*.png"))
    console = Console(width=110)
    with tempfile.TemporaryDirectory() as folder:
        for name in options.models.split(","):
            case = _CASES[name]
            n_frames = min(options.frames, len(paths)) // (1 if case.null_rate > 50 else 10)
            ways = _ways(Path(folder) / name, case, options.threads)
            rates = _rates(ways, paths[:n_frames], options.repeat)
            console.print(_rate_table(name, n_frames, rates))
            rate = options.null_rate or case.null_rate
            per_chunk = max(1, _CHUNK_TOKENS // case.tokens)
            idle = _idle_shares(ways, paths[:n_frames], rate, per_chunk, options.repeat)
            console.print(_idle_table(rate, idle))


def _read_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--models", default=",".join(_CASES), help="separated by commas")
    parser.add_argument("--frames", type=int, default=600, help="of SmolVLM2 a tenth")
    parser.add_argument("--threads", type=int, default=os.cpu_count(), help="of the present way")
    parser.add_argument("--repeat", type=int, default=5, help="turns of each way")
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


@dataclass(frozen=True)
class _Way:
    """A way to prepare frames: `process` makes pixels of an image, in `n_threads` ahead."""

    process: Callable[..., Any]
    n_threads: int
    batch: int = 1


def _ways(folder: Path, case: _Case, n_threads: int) -> dict[str, _Way]:
    folder.mkdir()
    (folder / "preprocessor_config.json").write_text(json.dumps(case.settings))
    quick = load_image_processor(folder)
    own = type(quick).__mro__[2](**quick.to_dict())  # transformers' class behind the quick one
    ways = {
        "before: batches of 8": _Way(own, 0, batch=8),
        "before, singly": _Way(own, 0),
        "now, no thread": _Way(quick, 0),
        f"now, {n_threads} threads ahead": _Way(quick, n_threads),
    }
    try:
        scaling = FrameScaling(image_backend="torchvision")
    except ValueError:
        return ways
    theirs = load_image_processor(folder, scaling)
    return ways | {
        "torchvision, no thread": _Way(theirs, 0),
        f"torchvision, {n_threads} threads ahead": _Way(theirs, n_threads),
    }


def _frames(paths: Sequence[Path]) -> list[Frame]:
    """Return frames as a prompt has them: their digests and sizes are read anew."""
    refs = [FrameRef(path) for path in paths]
    return [Frame(f"{at}{ref.digest}", ref.size, (), ref) for at, ref in enumerate(refs)]


@contextmanager
def _opened(way: _Way) -> Iterator[PixelsAhead]:
    def prepare(piece: Frame | Clip) -> Pixels:
        assert isinstance(piece, Frame)
        pixels: Pixels = way.process(images=[piece.ref.load()], return_tensors="pt")
        return pixels

    ahead = PixelsAhead(prepare, Ahead(way.n_threads))
    try:
        yield ahead
    finally:
        ahead.close()


def _feed(
    way: _Way, paths: Sequence[Path], per_chunk: int, compute: Callable[[int], None]
) -> float:
    """Prepare all frames in chunks, each computed on in between; return seconds of it all."""
    with _opened(way) as ahead:
        start = time.perf_counter()
        frames = _frames(paths)
        ahead.expect(frames)
        for at in range(0, len(frames), per_chunk):
            chunk = frames[at : at + per_chunk]
            if way.batch > 1:
                way.process(images=[frame.ref.load() for frame in chunk], return_tensors="pt")
            else:
                for frame in chunk:
                    ahead.take(frame)
            compute(len(chunk))
        return time.perf_counter() - start


def _rates(ways: dict[str, _Way], paths: Sequence[Path], repeat: int) -> dict[str, list[float]]:
    """Return frames a second of each way, in turns."""
    rates: dict[str, list[float]] = {name: [] for name in ways}
    with _one_torch_thread():
        for turn in range(repeat + 1):
            for name, way in ways.items():
                seconds = _feed(way, paths, way.batch, lambda _: None)
                if turn:  # the first one warms up
                    rates[name].append(len(paths) / seconds)
    return rates


def _idle_shares(
    ways: dict[str, _Way], paths: Sequence[Path], rate: int, per_chunk: int, repeat: int
) -> dict[str, list[float]]:
    """Return the share of time that the null model waits, of each way, in turns."""
    shares: dict[str, list[float]] = {name: [] for name in ways}
    with _one_torch_thread():
        for _ in range(repeat):
            for name, way in ways.items():
                seconds = _feed(way, paths, per_chunk, lambda n: time.sleep(n / rate))
                shares[name].append(1 - len(paths) / rate / seconds)
    return shares


@contextmanager
def _one_torch_thread() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def _rate_table(name: str, n_frames: int, rates: dict[str, list[float]]) -> Table:
    table = Table(f"{name}, {n_frames} frames", "frames/s", "least", "most", "times before, singly")
    base = rates["before, singly"]
    for way, values in rates.items():
        ratio = median([value / other for value, other in zip(values, base, strict=True)])
        table.add_row(way, *(f"{each(values):.1f}" for each in (median, min, max)), f"{ratio:.2f}")
    return table


def _idle_table(rate: int, shares: dict[str, list[float]]) -> Table:
    table = Table(f"null model of {rate} frames/s", "waits (% of the time)", "least", "most")
    for way, values in shares.items():
        table.add_row(way, *(f"{100 * each(values):.1f}" for each in (median, min, max)))
    return table


if __name__ == "__main__":
    main()
