"""Measure the index over many runs: how long it takes to make, and its size.

    python benchmarks/index_of_runs.py [--runs 200] [--records 1000] [--keep FOLDER]

The runs are copies of two baselines' runs on the bundled set, with as many records each
(`page_load.py` makes them). Prints a JSON object: seconds by the clock and of all processors, the
processors there are, megabytes, and seconds until the index and a run's page are drawn. The aim for
200 runs of 1,000 records: under 60 s and 50 MB. Needs Chromium and playwright.
"""

import argparse
import json
import os
import resource
import shutil
import tempfile
import time
from pathlib import Path

from page_load import DRAWN, browser_tab, make_runs, run_command


def main() -> None:
    """Make the runs and their index, and measure it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--records", type=int, default=1000, help="records of each run")
    parser.add_argument("--keep", type=Path, help="folder for all; else a temporary one")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep or Path(temporary)
        made = make_runs(folder, options.records, n_words=5)
        results = folder / "results"
        for number in range(options.runs):
            shutil.copytree(made[number % len(made)], results / f"run-{number}")
        out = folder / "index"
        before = _processor_seconds()
        start = time.perf_counter()
        run_command(Path(__file__).parents[1], "report", results, "--out", out)
        seconds = time.perf_counter() - start
        size = sum(path.stat().st_size for path in out.rglob("*.html"))
        print(
            json.dumps(
                {
                    "runs": options.runs,
                    "records": options.records,
                    "seconds": round(seconds, 1),
                    "processor_seconds": round(_processor_seconds() - before, 1),
                    "processors": os.cpu_count(),
                    "size_mb": round(size / 1e6, 1),
                    "index_opened_s": _opened(out / "index.html", "#results tbody tr"),
                    "run_opened_s": _opened(next((out / "runs").iterdir()), ".item"),
                }
            )
        )


def _processor_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _opened(page: Path, selector: str) -> float:
    """Return the seconds from the navigation until something of the page is drawn."""
    with browser_tab() as tab:
        tab.goto(page.as_uri())
        tab.wait_for_selector(selector)
        return round(tab.evaluate(DRAWN) / 1000, 2)


if __name__ == "__main__":
    main()
