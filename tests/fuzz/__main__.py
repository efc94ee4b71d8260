"""Read damaged inputs for some time, and report how many were tried and what was found.

    python -m tests.fuzz --list
    python -m tests.fuzz --reader trajectory --seconds 600
    python -m tests.fuzz --seconds 600           each reader in turn

Exit code 1 if anything was found. Every finding is printed with the file that shows it.
"""

import argparse
import collections
import contextlib
import os
import resource
import sys
import tempfile
import time
import traceback
import warnings
from pathlib import Path

from hypothesis import HealthCheck, Phase, Verbosity, given, seed, settings

from .damage import damaged
from .reader import Reader
from .readers import READERS

_BATCH = 200  # inputs between two looks at the clock
_MEMORY = 8 * 2**30  # bytes of address space beyond which an input is said to fill the memory
_FOUND = Path(tempfile.gettempdir()) / "infthor-fuzz"


def main() -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.fuzz", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--list", action="store_true", help="print the names of the readers")
    parser.add_argument(
        "--reader", action="append", choices=sorted(READERS), help="reader to try; default: all"
    )
    parser.add_argument("--seconds", type=float, default=600.0, help="time for each reader")
    parser.add_argument("--seed", type=int, default=0, help="seed of the first batch")
    options = parser.parse_args()
    if options.list:
        print("\n".join(READERS))
        return 0
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    warnings.simplefilter("ignore")
    names = options.reader or list(READERS)
    tried, found = zip(
        *(_campaign(READERS[name], options.seconds, options.seed) for name in names), strict=True
    )
    print(f"{len(names)} readers: {sum(tried):,} inputs; {sum(found)} different findings")
    return int(any(found))


def _campaign(reader: Reader, seconds: float, first_seed: int) -> tuple[int, int]:
    """Try one reader; return the numbers of inputs and of different findings."""
    counts: collections.Counter[str] = collections.Counter()
    findings: collections.Counter[str] = collections.Counter()
    end = time.monotonic() + seconds
    number = first_seed
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch).resolve()
        file = reader.make(folder)
        sound = file.read_bytes()
        reader.read(folder)

        def attempt(content: bytes) -> None:
            counts["tried"] += 1
            try:
                counts["refused"] += reader.hold(folder, file, content)
            except Exception as error:  # noqa: BLE001 - this is what is looked for
                _note(reader, error, content, findings)

        quiet = settings(
            max_examples=_BATCH, deadline=None, database=None, phases=(Phase.generate,),
            verbosity=Verbosity.quiet,
            suppress_health_check=list(HealthCheck),
        )  # fmt: skip
        # What is left out of a damaged journal is told, each time.
        with Path(os.devnull).open("w") as nowhere, contextlib.redirect_stderr(nowhere):
            while time.monotonic() < end:
                seed(number)(quiet(given(damaged(sound, reader.form))(attempt)))()
                number += 1
    print(f"{reader.name}: {counts['tried']:,} inputs in {seconds:g} s, {counts['refused']:,} "
          f"refused; {len(findings)} different findings", flush=True)  # fmt: skip
    return counts["tried"], len(findings)


def _note(
    reader: Reader, error: Exception, content: bytes, findings: collections.Counter[str]
) -> None:
    """Count a finding, and print and keep the first input that shows it."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [
        frame
        for frame in frames
        if "infthor_eval" in frame.filename or "model_adapters" in frame.filename
    ]
    last = (ours or frames)[-1]
    what = f"{type(error).__name__} at {Path(last.filename).name}:{last.lineno}"
    findings[what] += 1
    if findings[what] > 1:
        return
    _FOUND.mkdir(exist_ok=True)
    kept = _FOUND / f"{reader.name.replace(' ', '-')}-{len(findings)}"
    kept.write_bytes(content)
    print(f"{reader.name}: {what}: {str(error)[:200]!r}: {kept}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
