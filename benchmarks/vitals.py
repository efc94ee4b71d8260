"""Has a figure moved that no change may move unseen? Measure those in vitals.json, beside their
last committed values.

    python benchmarks/vitals.py [--data FOLDER] [--only WORD ...] [--commit "why"]

Prints a line for each figure. Exit code 1 if one has moved beyond its noise; then the change is
mended, or it is meant so and --commit writes the new value with the commit, the date and why. A
command that needs recorded data is left out, and said so, without --data. Samples are fixed:
vitals.json has the commands.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import msgspec

ROOT = Path(__file__).parents[1]
FILE = Path(__file__).with_suffix(".json")
_DATA = "{data}"  # in a command: the folder of recorded data
_SCRATCH = "{scratch}"  # in a command: an empty folder


class Figure(msgspec.Struct, omit_defaults=True):
    """One line of the table.

    Attributes:
        name: what is measured, and of what.
        path: where the number is in the JSON that the command prints: keys and indices joined by
            dots; two such paths with " / " between them are divided.
        value: last committed value; None: never measured.
        aim: value to be reached.
        noise: difference from run to run that says nothing.
        commit, date, why: when it was committed, and for what reason.
    """

    name: str
    path: str
    aim: float
    noise: float
    value: float | None = None
    commit: str = ""
    date: str = ""
    why: str = ""


class Measurement(msgspec.Struct, omit_defaults=True):
    """One command and the figures that it prints.

    Attributes:
        command: its words; the first is "python" or a command of this environment.
        figures: the figures.
        is_timed: it measures time, so nothing else runs beside it.
    """

    command: list[str]
    figures: list[Figure]
    is_timed: bool = False

    @property
    def needs_data(self) -> bool:
        """Whether it cannot be run without recorded data."""
        return _DATA in self.command


class Outcome(msgspec.Struct):
    """A figure as it was measured now; `problem` says why it was not."""

    figure: Figure
    now: float | None = None
    problem: str = ""

    @property
    def has_moved(self) -> bool:
        """Whether it is farther from its committed value than noise takes it, or could not be
        measured."""
        if self.now is None:
            return bool(self.problem)
        return (
            self.figure.value is None
            or abs(self.now - self.figure.value) > self.figure.noise + 1e-9
        )

    def line(self) -> str:
        """Return its line of the table."""
        figure = self.figure
        if self.now is None:
            return f"{figure.name:62} {self.problem or 'left out: needs --data'}"
        verdict = "new" if figure.value is None else "MOVED" if self.has_moved else ""
        return (
            f"{figure.name:62} {_text(self.now):>9} {_text(figure.value):>9} "
            f"{_text(figure.aim):>9}  {verdict}"
        )


def measure(measurement: Measurement, data: Path | None) -> list[Outcome]:
    """Run one command, and return what it says of each figure."""
    if measurement.needs_data and data is None:
        return [Outcome(figure) for figure in measurement.figures]
    with tempfile.TemporaryDirectory() as scratch:
        words = _words(measurement.command, {_DATA: str(data), _SCRATCH: scratch})
        done = subprocess.run(words, cwd=ROOT, capture_output=True, check=False)
    # A benchmark may end with 1, as some tell by that what they found; what it found is in what it
    # printed.
    try:
        document = json.loads(done.stdout)
    except ValueError:
        last = done.stderr.decode(errors="replace").strip().splitlines()[-1:] or ["nothing"]
        problem = f"failed with {done.returncode}: {last[0]:.80}"
        return [Outcome(figure, problem=problem) for figure in measurement.figures]
    return [_outcome(figure, document) for figure in measurement.figures]


def _outcome(figure: Figure, document: Any) -> Outcome:
    try:
        return Outcome(figure, number_at(document, figure.path))
    except (LookupError, TypeError, ValueError, ZeroDivisionError) as error:
        return Outcome(figure, problem=f"no number at {figure.path} ({type(error).__name__})")


def number_at(document: Any, path: str) -> float:
    """Return the number at a path of a JSON document, see `Figure`."""
    numerator, _, denominator = path.partition(" / ")
    if denominator:
        return number_at(document, numerator) / number_at(document, denominator)
    found = document
    for key in path.split("."):
        found = found[int(key)] if isinstance(found, list) else found[key]
    return float(found)


def measure_all(measurements: Sequence[Measurement], data: Path | None) -> Iterable[Outcome]:
    """Yield all outcomes: first what measures no time, two commands at once, then the others one by
    one."""
    untimed = [measurement for measurement in measurements if not measurement.is_timed]
    with ThreadPoolExecutor(2) as pool:
        for outcomes in pool.map(lambda measurement: measure(measurement, data), untimed):
            yield from outcomes
    for measurement in measurements:
        if measurement.is_timed:
            yield from measure(measurement, data)


def commit(outcomes: Iterable[Outcome], why: str) -> None:
    """Set the values that have moved to what was measured now."""
    revision = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    ).stdout.strip()
    for outcome in outcomes:
        if outcome.now is not None and outcome.has_moved:
            figure = outcome.figure
            figure.value, figure.commit, figure.why = round(outcome.now, 4), revision, why
            figure.date = datetime.now(UTC).date().isoformat()


def _words(command: Sequence[str], folders: dict[str, str]) -> list[str]:
    """Return a command as it is run: by this environment's programs, and with folders for the names
    of such."""
    program = (
        sys.executable
        if command[0] == "python"
        else str(Path(sys.executable).with_name(command[0]))
    )
    return [program, *(folders.get(word, word) for word in command[1:])]


def _text(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}" if abs(value) < 1000 else f"{value:.0f}"


def main() -> int:
    """Measure, print, and commit if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, help="folder of recorded data")
    parser.add_argument("--only", nargs="+", help="figures whose name has one of these words")
    parser.add_argument(
        "--commit", metavar="WHY", help="write the values that have moved into vitals.json"
    )
    parser.add_argument("--file", type=Path, default=FILE, help=argparse.SUPPRESS)
    options = parser.parse_args()
    measurements = msgspec.json.decode(options.file.read_bytes(), type=list[Measurement])
    chosen = [item for item in measurements if _is_chosen(item, options.only)]
    data = options.data.resolve() if options.data and options.data.exists() else None
    print(f"{'':62} {'now':>9} {'committed':>9} {'aim':>9}", flush=True)
    outcomes = []
    for outcome in measure_all(chosen, data):
        outcomes.append(outcome)
        print(outcome.line(), flush=True)
    if options.commit:
        commit(outcomes, options.commit)
        options.file.write_bytes(
            msgspec.json.format(msgspec.json.encode(measurements), indent=1) + b"\n"
        )
    moved = sum(outcome.has_moved for outcome in outcomes)
    if moved:
        print(
            f"{moved} moved: mend the change, or, if it is meant so: python benchmarks/vitals.py "
            "--commit WHY"
        )
    return 1 if moved and not options.commit else 0


def _is_chosen(measurement: Measurement, words: Sequence[str] | None) -> bool:
    names = " ".join(figure.name for figure in measurement.figures)
    return words is None or any(word in names for word in words)


if __name__ == "__main__":
    sys.exit(main())
