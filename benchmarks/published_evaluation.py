r"""Simulate a full published evaluation on 1, 8 and 64 GPUs: requests, hours, cost, and savings by
sharing.

225 trajectories with questions are sampled from the seed. Four models answer them in every mode, as
the harness does: a group is a trajectory, its contexts are sorted by their common prefixes, and a
request encodes only what the one before did not. Workers take the longest groups first; a worker
has as many GPUs as its longest context requires.

    python benchmarks/published_evaluation.py
    python benchmarks/published_evaluation.py --prefill qwen2.5-vl=8000:9000,128000:5000 \
        --decode qwen2.5-vl=35

The second command uses measurements on a GPU (benchmarks/gpu.md): tokens/s of encoding at two
lengths, and tokens/s of decoding at a short one. Rates without measurements are estimated from the
machine's numbers. benchmarks/cost.md has the formulae.
"""

from collections.abc import Sequence

from evaluation_costs import MODELS, largest_context
from evaluation_options import machine_of, rates_of, read_arguments
from evaluation_runs import Run, draw, modes, run

GPUS = (1, 8, 64)


def main() -> None:
    """Print the set, a line per run, and sums."""
    options = read_arguments(__doc__.splitlines()[0])
    machine = machine_of(options)
    trajectories = draw(options)
    n_frames = sum(trajectory.n_frames for trajectory in trajectories)
    n_questions = sum(len(trajectory.questions) for trajectory in trajectories)
    print(
        f"{len(trajectories)} trajectories, {n_frames} frames, {n_questions} questions, seed "
        f"{options.seed}"
    )
    print(
        f"attention {machine.attention}, {machine.parallel} over a worker's GPUs, "
        f"{options.price:.2f} USD a GPU-hour"
    )
    runs = [
        run(mode, shape, trajectories, rates_of(shape, machine, options), machine, options)
        for mode in modes(options)
        for shape in MODELS
    ]
    print(f"{work_table(runs)}\n\n{cost_table(runs, machine.load_seconds, options.price)}")
    print("\nlargest context by memory, in 1,000 tokens, on 1, 2, 4, 8 GPUs")
    for shape in MODELS:
        fitting = [f"{largest_context(shape, machine, n) / 1000:8,.0f}" for n in (1, 2, 4, 8)]
        print(
            f"{shape.name:17s}{''.join(fitting)}{shape.kv_bytes / 1e9 * 1e6:10.0f} GB of keys and "
            "values a million"
        )


_NAMES = f"{'mode':20s}{'model':17s}"
_WORK = (
    f"{_NAMES}{'requests':>9s}{'no window':>10s}{'too long':>9s}{'no memory':>10s}"
    f"{'Mtokens':>9s}{'encoded':>9s}{'longest':>9s}{'RoPE':>6s}"
)
_COST = (
    f"{_NAMES}{'GPUs':>5s}{'h on 1':>9s}{'on 8':>9s}{'on 64':>8s}{'USD 8':>9s}{'USD 64':>9s}"
    f"{'h on 8, not shared':>20s}{'saved':>8s}"
)


def work_table(runs: Sequence[Run]) -> str:
    """Return a line for each run: its requests and their tokens."""
    lines = [_WORK]
    for one in runs:
        extension = one.largest / one.model.limit
        lines.append(
            f"{one.mode:20s}{one.model.name:17s}{one.n_requests:9d}"
            f"{one.n_skipped[0]:10d}{one.n_skipped[1]:9d}{one.n_skipped[2]:10d}"
            f"{one.tokens / 1e6:9.0f}{one.encoded / 1e6:9.0f}{one.largest:9d}"
            f"{f'x{extension:.1f}' if extension > 1 else '-':>6s}"
        )
    return "\n".join(lines)


def cost_table(runs: Sequence[Run], load: float, price: float) -> str:
    """Return a line for each run, one for the sum of each model, and one for the sum of all: hours
    and cost."""
    lines = [_COST]
    for one in runs:
        lines.append(
            f"{one.mode:20s}{one.model.name:17s}{one.n_gpus or '-':>5}" + _times([one], load, price)
        )
    for name in dict.fromkeys(one.model.name for one in runs):
        of_model = [one for one in runs if one.model.name == name]
        lines.append(f"{'all':20s}{name:17s}{'':5s}" + _times(of_model, load, price))
    lines.append(f"{'all':20s}{'all':17s}{'':5s}" + _times(runs, load, price))
    return "\n".join(lines)


def _times(runs: Sequence[Run], load: float, price: float) -> str:
    """Return hours, cost and saving of successive runs, with a dash if one of them needs more
    GPUs."""
    hours = {n: _sum([one.hours(n, load) for one in runs]) for n in GPUS}
    without = _sum([one.hours(8, load, reuse=False) for one in runs])
    shown = f"{_number(hours[1], 9)}{_number(hours[8], 9)}{_number(hours[64], 8)}"
    shown += "".join(
        _number(None if (time := hours[n]) is None else price * n * time, 9, 0) for n in (8, 64)
    )
    saved = None if without is None or not hours[8] else without / hours[8]
    return shown + _number(without, 20) + _number(saved, 8)


def _sum(hours: Sequence[float | None]) -> float | None:
    known = [time for time in hours if time is not None]
    return sum(known) if len(known) == len(hours) else None


def _number(value: float | None, width: int, digits: int = 1) -> str:
    return "-".rjust(width) if value is None else f"{value:{width},.{digits}f}"


if __name__ == "__main__":
    main()
