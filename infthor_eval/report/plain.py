"""The presenter of suites that have none, and a base for those that have one."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from infthor_eval.report.charts import Chart
from infthor_eval.report.descriptions import Description, StepRow
from infthor_eval.report.presenter import (
    Figure,
    FindFrames,
    GroupScore,
    Replay,
    ReplyTokens,
    Timelines,
)
from infthor_eval.report.sample_columns import SampleColumn
from infthor_eval.report.web.sections import Section
from infthor_eval.report.web.thumbnails import ThumbnailStore
from infthor_eval.run import Run
from infthor_eval.runs import UnitRecord

_LONGEST = 2000  # characters of a field on the page
# Of twins, in any suite.
_NET_PAIRS = "net pairs"
_PAIRS_FINDING = "has {} net pairs"


class PlainPresenter:
    """How results of a suite are presented; a suite overrides what it has more of.

    Here samples are records' fields, and there are no charts, figures or replays.

    Attributes:
        title: heading of the suite's section; empty for the suite's name.
        measure: what the primary metric measures, in words.
        finding: the primary metric as the predicate of a sentence ("gets {} of the plans done").
        target_label: what a sample's target is called.
        reply_label: what the reply to a sample is called.
        member_label: what each record of a group is called, before its letter ("world").
        main_metric: metric that decides whether a sample is right; None for the first one of each
            sample.
        compares_scorers: whether the metrics judge the same reply, so that samples can be filtered
            by disagreement.
        replay: replays recorded episodes; None if the suite has no episodes.
        figures: figures by name, as `report --figure` takes it.
        columns: columns of the suite in the table of samples (`report.sample_columns`).
    """

    title: str = ""
    measure: str = "primary metric"
    finding: str = "reaches {} in the primary metric"
    target_label: str = "target"
    reply_label: str = "reply"
    member_label: str = "part"
    main_metric: str | None = None
    compares_scorers: bool = False
    replay: Replay | None = None
    figures: Mapping[str, Figure] = {}
    columns: Sequence[SampleColumn] = ()

    def measure_of(self, task: str, summary: Any) -> str:
        """Return what the primary metric of a task measures, by the suite's summary of a run;
        `measure`, unless tasks of the suite measure different things."""
        return _NET_PAIRS if self.has_pairs(task, summary) else self.measure

    def finding_of(self, task: str, summary: Any) -> str:
        """Return `finding`, as `measure_of` returns `measure`."""
        return _PAIRS_FINDING if self.has_pairs(task, summary) else self.finding

    def has_pairs(self, task: str, summary: Any) -> bool:
        """Return whether the primary metric of a task is net pairs of twins."""
        return False

    def chance(self, task: str, summary: Any, records: Sequence[UnitRecord[Any]]) -> float | None:
        """Return what `blind`, which sees no frame, scores in the primary metric of a task, on its
        answered records, 0 to 1; None if that is not known."""
        return None

    def is_share(self, metric: str, scores: Sequence[float]) -> bool:
        """Whether a metric with these scores is a share, which is shown in percent; others are
        shown as they are. One with a value below 0 or above 1 is none."""
        return all(0 <= score <= 1 for score in scores)

    def bounds(self, metric: str) -> tuple[float, float]:
        """Return the lowest and the highest possible score of a metric, one of `extra_scores` or
        `group_scores` included; infinite where there is no limit, or none is known."""
        return -math.inf, math.inf

    def extra_scores(self, record: UnitRecord[Any]) -> Mapping[str, float]:
        """Return scores that only some samples have, by name; runs are compared on those."""
        return {}

    def extra_ranges(self, record: UnitRecord[Any]) -> Mapping[str, tuple[float, float]]:
        """Return the lowest and the highest possible value of each of `extra_scores`."""
        return {}

    def explain(self, record: UnitRecord[Any]) -> Sequence[str]:
        """Return why the reply of a record got its scores, a line each."""
        return ()

    def group(self, record: UnitRecord[Any]) -> str:
        """Return the name of the record's group, which is one sample and right if all of it is.

        A group is of one task, variant and repetition. Empty for a record that is a sample by
        itself.
        """
        return ""

    def group_scores(self, records: Sequence[UnitRecord[Any]]) -> Iterable[GroupScore]:
        """Return the scores of the groups in a run's records of a task; runs are compared on
        them."""
        return ()

    def opening(self, runs: Sequence[Run]) -> Section | None:
        """Build the section that comes before the suite's own, with charts and tables of its own;
        tables of the suite that it has are not shown again."""
        return None

    def charts(self, runs: Sequence[Run]) -> Sequence[Chart]:
        """Draw the charts of the suite's section; its tables are `Suite.tables`."""
        return ()

    def sections(self, runs: Sequence[Run]) -> Iterable[Section]:
        """Build further sections, which follow the suite's own."""
        return ()

    def describe(self, record: UnitRecord[Any]) -> Description:
        """Describe the sample of a record: its id, where nothing more is known."""
        return Description(record.id)

    def reply(self, record: UnitRecord[Any]) -> str:
        """Return the reply of a record; empty if there is none, or if `details` has it."""
        return ""

    def reply_tokens(self, record: UnitRecord[Any]) -> ReplyTokens | None:
        """Return the tokens of the reply; None if they were not recorded."""
        return None

    def details(self, record: UnitRecord[Any]) -> Mapping[str, str]:
        """Return further facts about a record, by name: the fields of its payload."""
        payload = record.payload
        fields = {
            field.name: getattr(payload, field.name) for field in msgspec.structs.fields(payload)
        }
        return {name: _text(value) for name, value in fields.items() if value is not None}

    def recalled(self, record: UnitRecord[Any]) -> Sequence[int | str]:
        """Return what a memory recalled for a record: places of frames in the trajectory, and
        texts; empty without a memory."""
        return ()

    def steps(self, record: UnitRecord[Any]) -> Sequence[StepRow]:
        """Return the steps of a recorded episode; empty if it has none."""
        return ()

    def request_frames(self, run: Run, data: Path | None) -> FindFrames:
        """Return what finds the frames of a record's request (`prompts`), in their order; it raises
        DataError where they cannot be found."""
        return lambda _: ()

    def timelines(
        self, runs: Sequence[Run], data: Path | None, thumbnails: ThumbnailStore
    ) -> Timelines:
        """Find the samples' frames; `data` is the set's folder, None for the one a run names."""
        return Timelines()


def _text(value: Any) -> str:
    text = (
        value
        if isinstance(value, str)
        else json.dumps(msgspec.to_builtins(value), ensure_ascii=False)
    )
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
