"""Steps that evaluate: tiny models, the real one, several devices, and what all of it costs."""

import csv
from pathlib import Path
from typing import Any

import yaml

from infthor_eval.runs import UnitRecord

from .outcome import Outcome
from .work import BENCHMARKS, TINY_LIMIT, Run, StepFailed, Work

__all__ = [
    "ask_on_clues",
    "ask_on_trajectories",
    "compare_with_cpu",
    "count_questions",
    "estimate_costs",
    "run_tiny_models",
    "spread_model",
    "use_workers",
]

_ROOT = BENCHMARKS.parent
_QUESTIONS = _ROOT / "infthor_eval/sets/nieh_mini/qa_set_nieh_mini.csv"
_TABLE4 = _ROOT / "results/published/nieh_table4.yaml"
_TINY = ("qwen2.5-vl-tiny", "llava-onevision-tiny", "deepseek-vl-tiny", "pixtral-tiny")
_NEAR_TIE = 0.001  # nats, in float32
_TIES = (
    0.05  # share of replies of random weights that may differ, as two tokens are nearly as likely
)
_CACHED = 0.95  # share of the tokens of a further question that are encoded already
_SAVE = (
    "import sys, pathlib; from model_adapters.tiny.qwen2_5_vl import Qwen25VLTiny; "
    "Qwen25VLTiny.twin.save(pathlib.Path(sys.argv[1]), seed=0)"
)


def count_questions() -> int:
    """Return how many questions the bundled set has today."""
    with _QUESTIONS.open(encoding="utf-8", newline="") as file:
        return sum(1 for _ in csv.DictReader(file))


def run_tiny_models(work: Work) -> Outcome:
    """Evaluate four tiny models on the bundled set in half precision."""
    arguments = f"device={work.machine.device},dtype=bfloat16"
    runs, done = work.evaluate(
        "runs",
        *("--model", ",".join(_TINY), "--model-args", arguments, "--tasks", "nieh_mini_gt"),
        codes=(0, 1),
    )
    counts = {len(run.records) for run in runs}
    n_failed = sum(run.n_failed for run in runs)
    listed = " and ".join(map(str, sorted(counts)))
    n_asked = TINY_LIMIT if work.machine.tiny else count_questions()
    return Outcome(
        f"{len(runs)} models, {listed} questions each, {n_failed} failed, exit code {done.code}",
        (len(runs), counts, n_failed, done.code) == (len(_TINY), {n_asked}, 0, 0),
    )


def compare_with_cpu(work: Work) -> Outcome:
    """Ask the same questions in float32 on the device and on the processor."""
    device = work.machine.device
    here = _tiny_run(work, "device", f"device={device},margins=true")
    there = _tiny_run(work, "cpu", "device=cpu,margins=true")
    n, equal, margin = len(here.records), here.n_equal(there), here.parting_margin(there)
    right = equal == n or (margin is not None and margin <= _NEAR_TIE)
    text = f"{equal} of {n} replies equal"
    if margin is not None:
        text += f"; the others part {'at a near tie, ' if right else ''}by {margin:.4f} nats"
    if not right:
        eager = _tiny_run(work, "eager", f"device={device},attn_implementation=eager")
        text += f"; {eager.n_equal(there)} with attn_implementation=eager on the device"
    return Outcome(text, right)


def _tiny_run(work: Work, name: str, arguments: str, *words: str, fresh: bool = False) -> Run:
    runs, _ = work.evaluate(
        name,
        *("--model", _TINY[0], "--model-args", f"dtype=float32,{arguments}"),
        *("--tasks", "nieh_mini_gt", *words),
        fresh=fresh,
    )
    return runs[0]


def _subject(work: Work, *options: str) -> tuple[str, ...]:
    """Return the words of the real model, or of its tiny twin in a rehearsal."""
    given = [f"device={work.machine.device}", *options]
    if work.machine.tiny:
        return ("--model", _TINY[0], "--model-args", ",".join(given))
    given.insert(0, f"pretrained={work.machine.checkpoint}")
    return ("--model", "qwen2.5-vl", "--model-args", ",".join(given))


def ask_on_clues(work: Work) -> Outcome:
    """Ask the real model on clue frames, in each precision and with each kernel."""
    machine = work.machine
    if machine.download and machine.data and not (machine.data / "metadata").is_dir():
        work.command("fetch", "nieh", "--out", str(machine.data))
    tasks = ("--tasks", "nieh_mini_gt")
    if not machine.tiny:
        tasks = ("--tasks", "nieh_gt", "--data", str(machine.data), "--limit", "200")
    ways = [("bfloat16", kernel) for kernel in machine.kernels[::-1]] + [("float16", "sdpa")]
    texts, n_failed = [], 0
    for dtype, kernel in ways:
        subject = _subject(work, f"dtype={dtype}", f"attn_implementation={kernel}")
        runs, _ = work.evaluate(f"{dtype}-{kernel}", *subject, *tasks, codes=(0, 1))
        n_failed += runs[0].n_failed
        texts.append(f"{dtype}, {kernel}: {runs[0].accuracy('reference'):.1f} %")
    return Outcome(
        f"{'; '.join(texts)} (Table 4: {_published():.1f}); {n_failed} failed", n_failed == 0
    )


def _published() -> float:
    rows = yaml.safe_load(_TABLE4.read_text(encoding="utf-8"))["rows"]
    (row,) = [row for row in rows if row["name"] == "Qwen2.5-VL 7B"]
    return row["values"][-1]


def ask_on_trajectories(work: Work) -> Outcome:
    """Ask the real model on whole trajectories: all but the first question of one are cached."""
    runs, _ = work.evaluate(
        "runs", *_subject(work, "dtype=bfloat16"), "--tasks", "nieh_mini_full", codes=(0, 1)
    )
    records = runs[0].records
    # The first question of a trajectory is the one that found least of it.
    by_trajectory: dict[str, list[UnitRecord[Any]]] = {}
    for record in sorted(records, key=lambda record: record.usage.cached):
        by_trajectory.setdefault(record.cluster, []).append(record)
    # Questions that are answered together have equal shares of their time: only sums say something.
    seconds = sum(record.seconds for record in records) / len(records)
    later = [record.usage for same in by_trajectory.values() for record in same[1:]]
    n_tokens = sum(usage.context for usage in later)
    cached = sum(usage.cached for usage in later) / n_tokens if n_tokens else 0.0
    return Outcome(
        f"{len(records)} questions on {len(by_trajectory)} trajectories, {seconds:.2f} s each; "
        f"{100 * cached:.1f} % of the tokens of later questions cached; {runs[0].n_failed} failed",
        runs[0].n_failed == 0 and cached >= _CACHED,
    )


def spread_model(work: Work) -> Outcome:
    """Spread one model over all devices, and compare it with the one on a single device."""
    if work.machine.checkpoint is None:
        folder = work.folder / "tiny"
        work.python("-c", _SAVE, str(folder))
    else:
        folder = Path(work.machine.checkpoint)
    runs = []
    for name, place in (("one", f"device={work.machine.device}"), ("spread", "device_map=auto")):
        of_place, _ = work.evaluate(
            name,
            *("--model", "qwen2.5-vl", "--tasks", "nieh_mini_full", "--limit", "6"),
            *("--model-args", f"pretrained={folder},dtype=bfloat16,{place}"),
        )
        runs.append(of_place[0])
    one, spread = runs
    n, equal = len(one.records), spread.n_equal(one)
    seconds = [sum(record.seconds for record in run.records) for run in runs]
    return Outcome(
        f"{equal} of {n} replies equal; {seconds[0]:.1f} s on one device, "
        f"{seconds[1]:.1f} s spread",
        n - equal <= max(1, _TIES * n),
    )


def use_workers(work: Work) -> Outcome:
    """Share a run between two processes."""
    real = work.machine.gpus > 1 and work.machine.checkpoint is not None
    subject = ("--model", _TINY[0], "--model-args", f"device={work.machine.device}")
    if real:  # each process gets its share of the GPUs
        subject = _subject(work, "dtype=bfloat16")
    seconds, runs = [], []
    for workers in ("1", "2"):
        of_workers, done = work.evaluate(
            workers, *subject, "--tasks", "nieh_mini_gt", "--workers", workers, fresh=True
        )
        seconds.append(done.seconds)
        runs.append(of_workers[0])
    equal, n = runs[0].n_equal(runs[1]), len(runs[0].records)
    return Outcome(
        f"{equal} of {n} replies equal; {seconds[0]:.0f} s by one worker, {seconds[1]:.0f} s by two"
        + ("" if work.machine.gpus > 1 else ", which share one device"),
        equal == n,
    )


def estimate_costs(work: Work) -> Outcome:
    """Estimate the whole evaluation: of this model from a few units, of all from step 3's rates."""
    tasks = ("--tasks", "nieh_mini", "--limit", "6")
    if not work.machine.tiny:
        tasks = ("--tasks", "nieh", "--data", str(work.machine.data))
    done = work.command(
        "plan",
        *_subject(work, "dtype=bfloat16"),
        *tasks,
        *("--measure", "3", "--price-per-hour", "3"),
    )
    lines = [line for line in done.output.splitlines() if line.startswith(("time:", "money:"))]
    if not lines:
        raise StepFailed("plan prints no time; see its log")
    return Outcome("; ".join([*lines, *_published_evaluation(work)]))


def _published_evaluation(work: Work) -> list[str]:
    """Return what the published evaluation of this model would take at the measured rates."""
    speeds = work.earlier.get("speed")
    if not speeds:
        return ["the published evaluation: needs the rates of the step on speed"]
    kernel = work.machine.kernels[-1]
    prefill = speeds[kernel]["prefill"]
    rates = [point["rate"] for point in prefill]
    if work.machine.tiny:  # a busy machine encodes a longer context of a tiny model faster at times
        rates.sort(reverse=True)
    points = ",".join(
        f"{point['tokens']}:{rate:.1f}" for point, rate in zip(prefill, rates, strict=True)
    )
    done = work.benchmark(
        "published_evaluation.py",
        *("--prefill", f"qwen2.5-vl={points}", "--attention", kernel),
        *("--decode", f"qwen2.5-vl={speeds[kernel]['decode']:.1f}"),
    )
    row = next(
        line.split()
        for line in done.output.splitlines()
        if line.split()[:2] == ["all", "qwen2.5-vl"]
    )
    return [f"the published evaluation: {row[2]} h on one GPU, {row[3]} h on 8"]
