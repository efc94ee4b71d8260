"""The page itself: a file that needs no others."""

import base64
import json
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import msgspec
from markupsafe import Markup

from infthor_eval.pages.one_file import LOOK, THEME, read_part, write_page_file
from infthor_eval.report.exporting import export_tables
from infthor_eval.report.svg import draw
from infthor_eval.report.web.samples import FrameFacts, Numbered, PageSample, Prompt
from infthor_eval.report.web.sections import Section

_read = partial(read_part, __package__)
_SCRIPTS = (
    "wide.js",
    "tables.js",
    "elements.js",
    "address.js",
    "enlarged.js",
    "prompts.js",
    "blink.js",
    "group.js",
    "answers.js",
    "sample.js",
    "orders.js",
    "report.js",
)  # one script on the page, in this order

_PICTURES = "pictures"
# A browser takes longer to read so many letters from a disk than to unpack them.
_LONG = 4_000_000

# "</script" and "<!--" would end or twist a script element; line separators end a script's line.
_ESCAPED = {
    "<": "\\u003c",
    ">": "\\u003e",
    "&": "\\u0026",
    "\u2028": "\\u2028",
    "\u2029": "\\u2029",
}


@dataclass(frozen=True)
class About:
    """A run's settings.

    Attributes:
        label: name of the run.
        facts: names and values, in the order shown.
        command: command that repeats the run; empty if unknown.
        config: everything that can change a number, as JSON.
    """

    label: str
    facts: tuple[tuple[str, str], ...]
    command: str
    config: str


class SuiteLabels(msgspec.Struct, frozen=True):
    """How the samples of a suite are shown.

    Attributes:
        runs: places of the suite's runs among those of the page.
        target: what a sample's target is called.
        reply: what the reply to a sample is called.
        compares_scorers: whether samples can be filtered by disagreement of the metrics.
        member: what each member of a group is called, before its letter.
    """

    runs: tuple[int, ...]
    target: str
    reply: str
    compares_scorers: bool
    member: str = ""


def embedded_remark(which: str) -> str:
    """Return the remark of a page on frames of the embedded simulator, in which of its runs."""
    return (
        f"Frames are the embedded simulator's{which}: no number is comparable with published ones."
    )


@dataclass(frozen=True)
class Page:
    """Contents of the page.

    Attributes:
        title: title of the page.
        version: version of the package that built it.
        runs: settings of the runs.
        suites: how samples are shown, by suite.
        sections: tables and charts; the first section answers what the page is opened for.
        samples: samples for the browser.
        metrics: names of the metrics, those that decide the outcome first.
        pictures: WebP in base64, by their numbers in the samples.
        notes: remarks on the samples.
        is_packed: whether all data of the samples are compressed, to a sixth of their size; those
            of many samples are in any case.
        remark: what stands first, on what the numbers are not comparable with; empty for none.
        large: number of the enlarged picture by that of its thumbnail.
        frames: what is known of frames, by their numbers in the samples.
        prompts: requests as they were sent, by their numbers in the samples.
        tracebacks: tracebacks of failures, by their numbers in the samples.
        explanations: why replies got their scores, by their numbers in the samples.
    """

    title: str
    version: str
    runs: Sequence[About] = ()
    suites: Mapping[str, SuiteLabels] = field(default_factory=dict)
    sections: Sequence[Section] = ()
    samples: Sequence[PageSample] = ()
    metrics: Sequence[str] = ()
    pictures: Sequence[str] = ()
    notes: Sequence[str] = ()
    is_packed: bool = False
    remark: str = ""
    large: Mapping[int, int] = field(default_factory=dict)
    frames: Sequence[FrameFacts] = ()
    prompts: Sequence[Prompt] = ()
    tracebacks: Sequence[str] = ()
    explanations: Sequence[str] = ()


def write_page(page: Page, path: Path) -> int:
    """Write the page into a file and return its size in bytes; equal pages are equal bytes."""
    values = {
        "page": page,
        "data": [_embedded(page, name, value) for name, value in _data(page).items()],
        "svg": lambda chart: Markup(draw(chart)),
        "csv": lambda table: export_tables([table], "csv"),
    }
    return write_page_file(
        path,
        _read("report.html"),
        values,
        style=[LOOK, _read("report.css")],
        script=[THEME, *map(_read, _SCRIPTS)],
    )


def _data(page: Page) -> dict[str, Any]:
    """Return the data of the samples' browser by the ids of their script elements.

    Explanations are read when the first one is unfolded, and pictures are compressed already.
    """
    samples, facts = _share_details(msgspec.to_builtins(page.samples))
    document = {
        "runs": [run.label for run in page.runs],
        "suites": msgspec.to_builtins(page.suites),
        "metrics": list(page.metrics),
        "samples": samples,
        "details": facts,
        "large": page.large,
        "frames": msgspec.to_builtins(page.frames),
        "prompts": msgspec.to_builtins(page.prompts),
        "tracebacks": list(page.tracebacks),
    }
    return {
        "data": document,
        _PICTURES: list(page.pictures),
        "explanations": list(page.explanations),
    }


@dataclass(frozen=True)
class _Embedded:
    """Data in a script element: its id, its text, and whether that is compressed."""

    id: str
    text: Markup
    is_packed: bool


def _embedded(page: Page, name: str, value: Any) -> _Embedded:
    """Return a value as JSON that is safe in a script element."""
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"))
    for letter, escaped in _ESCAPED.items():
        text = text.replace(letter, escaped)
    is_packed = page.is_packed or (name != _PICTURES and len(text) > _LONG)
    if is_packed:
        text = base64.b64encode(zlib.compress(text.encode("utf-8", "backslashreplace"))).decode()
    return _Embedded(name, Markup(text), is_packed)


def _share_details(samples: list[Any]) -> tuple[list[Any], list[tuple[str, str]]]:
    """Return samples with numbers of details, and the details: many have the same."""
    facts: Numbered[tuple[str, str]] = Numbered()
    parts = chain.from_iterable(sample.get("members", [sample]) for sample in samples)
    for result in filter(None, chain.from_iterable(part["results"] for part in parts)):
        if "details" in result:
            result["details"] = [facts.number(pair) for pair in result["details"].items()]
    return samples, facts.values
