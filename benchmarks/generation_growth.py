"""Measure whether generation is linear: time per step and memory of a short and a long trajectory
in one scene.

The ratio is that of processor time, of this process and the simulator's together, because other
work on the machine changes wall time much more.

python benchmarks/generation_growth.py [--scene kitchen-1] [--steps 1000 10000] [--seed 1]
"""

import argparse
import resource
import tempfile
import time
from pathlib import Path

from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.generation.generate_set import generate_set
from infthor_eval.generation.settings import TrajectorySettings
from infthor_eval.thor.launch import embedded_launch
from infthor_eval.thor.simulator import Simulator


def main() -> None:
    """Generate one trajectory of each length, and print time per step and peak memory."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", default="kitchen-1")
    parser.add_argument("--steps", type=int, nargs="+", default=[1000, 10_000])
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    print(
        f"{'steps':>7} {'sub-goals':>9} {'seconds':>8} {'ms/step':>8} {'CPU ms/step':>12} "
        f"{'peak MB':>8} {'peak MB, simulator':>19}"
    )
    per_step = []
    for steps in options.steps:
        before = processor_seconds()
        seconds, n_steps, subgoals, simulator_mb = generate_one(
            TrajectorySettings(options.scene, options.seed, steps, 1, max_fail=steps)
        )
        per_step.append(1000 * (processor_seconds() - before) / n_steps)
        own_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(
            f"{n_steps:7} {subgoals:9} {seconds:8.1f} {1000 * seconds / n_steps:8.2f} "
            f"{per_step[-1]:12.2f} {own_mb:8.0f} {simulator_mb:19.0f}",
            flush=True,
        )
    print(
        f"processor time per step, longest over shortest: {per_step[-1] / per_step[0]:.2f} (aim <= "
        "1.3)"
    )


def processor_seconds() -> float:
    """Return the processor time so far of this process and of simulators that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(item.ru_utime + item.ru_stime for item in used)


def generate_one(settings: TrajectorySettings) -> tuple[float, int, int, float]:
    """Generate a trajectory; returns seconds, low-level actions, sub-goals and the simulator's peak
    memory (MB)."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        with Simulator(embedded_launch()) as simulator:
            start = time.perf_counter()
            result = generate_set([settings], simulator, out)
            seconds = time.perf_counter() - start
        if result.failures:
            raise SystemExit(result.failures[0])
        (trajectory,) = iter_trajectories(out)
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    return seconds, len(trajectory.plan.low_actions), len(trajectory.plan.high_pddl), peak


if __name__ == "__main__":
    main()
