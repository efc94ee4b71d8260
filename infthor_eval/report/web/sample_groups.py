"""Samples that are one together, such as both questions of a pair of twins."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from infthor_eval.report.web.samples import PageSample, SampleResult


class GroupKey(NamedTuple):
    """A group, within its task, variant and repetition."""

    task: str
    variant: str
    repeat: int
    name: str


def group_samples(samples: Iterable[tuple[GroupKey, PageSample]]) -> list[PageSample]:
    """Return samples with those of a group as one, in the place of its first.

    A sample without a name of a group stays by itself, and so does the only one of a group.
    """
    groups: dict[GroupKey | int, list[PageSample]] = {}
    for number, (key, sample) in enumerate(samples):
        groups.setdefault(key if key.name else number, []).append(sample)
    return [
        _group(key.name, members) if isinstance(key, GroupKey) and len(members) > 1 else members[0]
        for key, members in groups.items()
    ]


def _group(name: str, members: Sequence[PageSample]) -> PageSample:
    first = members[0]
    by_run = zip(*(member.results for member in members), strict=True)
    return PageSample(
        suite=first.suite,
        task=first.task,
        id=name,
        cluster=first.cluster,
        title=first.title,
        results=tuple(map(_result, by_run)),
        variant=first.variant,
        kind=first.kind,
        clues=first.clues,
        members=tuple(members),
    )


def _result(results: Sequence[SampleResult | None]) -> SampleResult | None:
    """Return the result of a run on a group; None if it did not evaluate all of it."""
    outcomes = [result.outcome for result in results if result is not None]
    return SampleResult(_outcome(outcomes)) if len(outcomes) == len(results) else None


def _outcome(outcomes: Sequence[str]) -> str:
    """Return "right" if all are, and "partly" if some are."""
    for left_out in ("excluded", "failed", "not asked"):
        if left_out in outcomes:
            return left_out
    if all(outcome == "right" for outcome in outcomes):
        return "right"
    return "wrong" if all(outcome == "wrong" for outcome in outcomes) else "partly"
