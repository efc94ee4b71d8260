"""Measure the memory of a run beside its model, for a trajectory of thousands of frames.

It is a whole run in one process: an NIEH set of noise frames, `nieh_full`, the journal, and the
back end with a Qwen2.5-VL that has a vision tower but no language layer. Every frame is decoded,
cut into patches and embedded, and every prompt is tokenised, as for a real model. Attention, keys
and values, which depend on the model, cost nothing. A run on three frames comes first. The memory
after it, with everything imported and a model loaded and used, is subtracted from the peak of the
second run. Linux only (VmHWM).

    python benchmarks/data_path_memory.py [--frames 2300] [--questions 24]
"""

import argparse
import gc
import tempfile
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from noise_set import write_set

from infthor_eval.cli.options.run import RunOptions
from infthor_eval.cli.options.values import ModelSpec
from infthor_eval.runs import UnitRecord, execute, prepare
from model_adapters.tiny.qwen2_5_vl import Qwen25VLTiny

PROCESS = Path("/proc/self")


def main() -> None:
    """Run twice, and print tokens, seconds and memory."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=2300)
    parser.add_argument("--questions", type=int, default=24)
    options = parser.parse_args()
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        replace(Qwen25VLTiny.twin, config=_without_layers).save(folder / "checkpoint", seed=0)
        write_set(folder / "small", 3, 2)
        write_set(folder / "large", options.frames, options.questions)
        answer(folder, "small")
        gc.collect()
        before = megabytes("VmRSS")
        (PROCESS / "clear_refs").write_text("5")  # the peak counts from here on
        start = time.perf_counter()
        records = answer(folder, "large")
        seconds = time.perf_counter() - start
        peak = megabytes("VmHWM")
    print(
        f"{options.frames} frames, {options.questions} questions of {records[0].tokens.context:,} "
        "tokens, nieh_full"
    )
    print(f"run             {seconds:8.1f} s")
    print(f"process before  {before:8.0f} MB")
    print(f"peak            {peak:8.0f} MB")
    print(f"growth          {peak - before:8.0f} MB")


def _without_layers(ids: Mapping[str, int], vocab_size: int) -> Any:
    config = Qwen25VLTiny.twin.config(ids, vocab_size)
    config.text_config.num_hidden_layers, config.text_config.layer_types = 0, []
    return config


def answer(folder: Path, data: str) -> list[UnitRecord]:
    """Return the records of a run on one of the sets.

    Raises:
        RuntimeError: a question failed, which would make the numbers meaningless.
    """
    options = {"pretrained": str(folder / "checkpoint"), "device": "cpu", "max_tokens": "0"}
    models = (ModelSpec("qwen2.5-vl", options),)
    ((request, suite),) = RunOptions(
        models, ("nieh_full",), folder / data, folder / "out"
    ).requests()
    records = execute(prepare(request, suite)).records
    failures = [record.failure for record in records if record.failure]
    if failures:
        raise RuntimeError(failures[0])
    return records


def megabytes(field: str) -> float:
    """Return a field of the process's status in MB (10^6 bytes)."""
    line = next(
        line
        for line in (PROCESS / "status").read_text().splitlines()
        if line.startswith(f"{field}:")
    )
    return int(line.split()[1]) * 1024 / 1e6


if __name__ == "__main__":
    main()
