"""Measure the report's page of many records: how long it takes to make, to open, and to filter.

    python benchmarks/page_load.py [--records 20000] [--words 40] [--against CHECKOUT] [--keep
    FOLDER]

A small run of two baselines on the bundled set is made; its records are then copied, as replies to
questions that differ in a number, until there are enough. Replies get more words, as those of a
model have. Prints one JSON object per checkout: seconds to make the page, its size, seconds from
the navigation until the list is drawn (medians of five), and milliseconds from a keystroke in the
search or a change of a filter until the next frame is painted (the longest of five each). Needs
Chromium and playwright.
"""

import argparse
import csv
import json
import os
import random
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
from playwright.sync_api import Page, sync_playwright

from infthor_eval.formats.nieh_set import NiehSet
from infthor_eval.formats.packed.paths import frame_sources
from infthor_eval.nieh.records import RECORDS
from infthor_eval.runs.journals.shards import FOLDER, read_run
from infthor_eval.storage.folders import packaged_folder

_MODELS, _TASK = ("oracle", "blind"), "nieh_gt"
_ROUNDS = 5
_BROWSERS = ("chromium", "chromium-browser", "google-chrome")
# Resolves when what an input changed is on the screen.
_UNTIL_PAINTED = """change => new Promise(resolve => {
  const start = performance.now();
  new Function(change)();
  requestAnimationFrame(() => setTimeout(() => resolve(performance.now() - start)));
})"""
DRAWN = (
    "new Promise(resolve => requestAnimationFrame(() => setTimeout(() => "
    "resolve(performance.now()))))"
)
_SEARCHES = ("h", "ha", "have", "bowl (copy 7", "no such words", "")


def main() -> None:
    """Make the runs, then the page by each checkout, and measure it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--records", type=int, default=20_000, help="records of each of the two runs"
    )
    parser.add_argument("--words", type=int, default=40, help="words that are added to each reply")
    parser.add_argument(
        "--against", type=Path, help="another checkout, whose page is measured, too"
    )
    parser.add_argument(
        "--keep", type=Path, help="folder for the runs and the pages; else a temporary one"
    )
    options = parser.parse_args()
    here = Path(__file__).parents[1]
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep or Path(temporary)
        runs = make_runs(folder, options.records, options.words)
        for checkout in filter(None, (options.against, here)):
            page = folder / f"{'here' if checkout == here else 'against'}.html"
            start = time.perf_counter()
            run_command(checkout, "report", *runs, "--data", folder / "set", "--out", page)
            made = round(time.perf_counter() - start, 1)
            size = round(page.stat().st_size / 1e6, 1)
            print(
                json.dumps(
                    {"checkout": str(checkout), "made_s": made, "size_mb": size, **measure(page)}
                ),
                flush=True,
            )


def run_command(checkout: Path, *words: Any) -> None:
    """Run a command of a checkout."""
    environment = {**os.environ, "PYTHONPATH": str(checkout), "PYTHONSAFEPATH": "1"}
    command = (sys.executable, "-c", "from infthor_eval.cli import main; main()", *map(str, words))
    subprocess.run(
        command, env=environment, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )


def make_runs(folder: Path, n_records: int, n_words: int) -> list[Path]:
    """Return the folders of the runs: those on the bundled set, copied to a set with that many
    questions."""
    small = packaged_folder("sets/nieh_mini")
    output = folder / "small"
    run_command(
        Path(__file__).parents[1],
        "--model",
        ",".join(_MODELS),
        "--tasks",
        _TASK,
        "--data",
        small,
        "--out",
        output,
    )
    large = copy_set(small, folder / "set", n_records)
    return [
        copy_run(next((output / model).iterdir()), folder / model, large, n_words)
        for model in _MODELS
    ]


def copy_set(small: Path, folder: Path, n_questions: int) -> NiehSet:
    """Write a set with that many questions on the same trajectories."""
    folder.mkdir(parents=True)
    for source in frame_sources(small):
        (folder / source.name).symlink_to(source)
    shutil.copy(small / "set.json", folder)
    (file,) = small.glob("qa_set*.csv")
    with (
        file.open(encoding="utf-8", newline="") as source,
        (folder / "qa_set.csv").open("w", newline="") as target,
    ):
        rows = list(csv.DictReader(source))
        writer = csv.DictWriter(target, list(rows[0]))
        writer.writeheader()
        for place in range(n_questions):
            number, row = divmod(place, len(rows))
            writer.writerow(rows[row] | {"question": f"{rows[row]['question']} (copy {number})"})
    return NiehSet(folder)


def copy_run(small: Path, folder: Path, large: NiehSet, n_words: int) -> Path:
    """Write a run on the larger set, with the records of a run on the small one."""
    header, records = read_run(small, RECORDS)
    config = header.config
    task = msgspec.structs.replace(config.tasks[_TASK], data=large.fingerprint)
    config = msgspec.structs.replace(config, tasks={_TASK: task})
    counts = {"n_units": len(large.questions), "units_by_task": {_TASK: len(large.questions)}}
    header = msgspec.structs.replace(header, config=config, **counts)
    draw = random.Random(0)
    words = sorted({word for record in records for word in record.payload.question.split()})
    by_question = {(record.cluster, record.payload.question): record for record in records}
    (folder / FOLDER).mkdir(parents=True)
    with (folder / FOLDER / "worker-0.jsonl").open("wb") as file:
        file.write(msgspec.json.encode(header) + b"\n")
        for question in large.questions:
            record = by_question[question.traj_id, question.text.rpartition(" (copy ")[0]]
            reply = " ".join([record.payload.reply or "", *draw.choices(words, k=n_words)])
            payload = msgspec.structs.replace(record.payload, question=question.text, reply=reply)
            copy = msgspec.structs.replace(record, id=question.id, payload=payload)
            file.write(msgspec.json.encode(copy) + b"\n")
    return folder


def measure(page: Path) -> dict[str, Any]:
    """Return the times of a page in a browser."""
    with browser_tab() as tab:
        opened = []
        for _ in range(_ROUNDS):
            tab.goto("about:blank")
            tab.goto(page.as_uri())
            tab.wait_for_selector(".item")
            opened.append(tab.evaluate(DRAWN) / 1000)
        times = {
            name: max(tab.evaluate(_UNTIL_PAINTED, change) for _ in range(_ROUNDS))
            for name, change in changes()
        }
    return {
        "opened_s": round(statistics.median(opened), 2),
        "longest_ms": {name: round(value) for name, value in times.items()},
    }


@contextmanager
def browser_tab() -> Iterator[Page]:
    """Open a tab of Chromium, as wide as a screen."""
    path = next(filter(None, map(shutil.which, _BROWSERS)))
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser.new_page(viewport={"width": 1400, "height": 1000})
        browser.close()


def changes() -> Iterator[tuple[str, str]]:
    """Yield what is changed on the page: a name, and the script that does it."""
    told = "it.dispatchEvent(new Event('input', {bubbles: true}))"
    for text in _SEARCHES:
        yield (
            f"search {text!r}",
            f"const it = document.getElementById('search'); it.value = {text!r}; {told}",
        )
    for name, place in (
        ("outcome", 3),
        ("outcome", 0),
        ("kind", 1),
        ("kind", 0),
        ("run", 1),
        ("against", 2),
        ("against", 0),
        ("run", 0),
        ("sort", 1),
        ("sort", 4),
        ("sort", 0),
    ):
        yield (
            f"{name} {place}",
            f"const it = document.getElementById('{name}'); it.selectedIndex = {place}; {told}",
        )
    for name in ("disagree", "differ"):
        yield name, f"document.getElementById('{name}').click()"
    yield (
        "next sample",
        "document.dispatchEvent(new KeyboardEvent('keydown', {key: 'j', bubbles: true}))",
    )


if __name__ == "__main__":
    main()
