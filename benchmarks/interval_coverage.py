"""Measure how often the clustered 95 % interval covers the true accuracy of simulated data sets.

Each data set has trajectories of different sizes. The accuracy of a trajectory is sampled from a
beta distribution, so that questions on one trajectory are correlated, and each question is right
with this probability.

    python benchmarks/interval_coverage.py [--sets 2000] [--trajectories 60] [--accuracy 0.7]
    python benchmarks/interval_coverage.py --ends     # few trajectories, nearly all questions right
"""

import argparse

import numpy as np

from infthor_eval.statistics import clustered_mean


def coverage(
    n_sets: int, n_trajectories: int, accuracy: float, spread: float = 6.0, seed: int = 0
) -> tuple[float, float]:
    """Return the shares of data sets whose interval covers the true accuracy: clustered, and as if
    independent."""
    random = np.random.default_rng(seed)
    clustered = independent = 0
    for _ in range(n_sets):
        sizes = random.integers(5, 40, size=n_trajectories)
        own = random.beta(accuracy * spread, (1 - accuracy) * spread, size=n_trajectories)
        scores = [
            float(right) for p, n in zip(own, sizes, strict=True) for right in random.random(n) < p
        ]
        names = np.repeat(np.arange(n_trajectories), sizes).tolist()
        for_trajectories = clustered_mean(scores, names)
        for_questions = clustered_mean(scores, list(range(len(scores))))
        clustered += for_trajectories.low <= accuracy <= for_trajectories.high
        independent += for_questions.low <= accuracy <= for_questions.high
    return clustered / n_sets, independent / n_sets


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=2000)
    parser.add_argument("--trajectories", type=int, default=60)
    parser.add_argument("--accuracy", type=float, default=0.7)
    parser.add_argument(
        "--ends", action="store_true", help="a table near the end of the scale instead"
    )
    options = parser.parse_args()
    if options.ends:
        for trajectories in (6, 12, 30):
            row = [
                coverage(options.sets, trajectories, accuracy)[0] for accuracy in (0.9, 0.97, 0.99)
            ]
            shown = ", ".join(f"{100 * share:.1f}" for share in row)
            print(
                f"{trajectories} trajectories, accuracy 0.9, 0.97, 0.99: {shown} % (aim 93 % at "
                "least)"
            )
        raise SystemExit
    by_trajectory, by_question = coverage(options.sets, options.trajectories, options.accuracy)
    print(f"clustered by trajectory: {100 * by_trajectory:.1f} % (aim 93-97 %)")
    print(f"as if independent:       {100 * by_question:.1f} %")
