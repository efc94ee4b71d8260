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


class PlainPresenter:
    """See `Presenter`: samples are records' fields; there are no charts, figures or replays."""

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
        """See `Presenter.measure_of`: `measure`."""
        return self.measure

    def finding_of(self, task: str, summary: Any) -> str:
        """See `Presenter.finding_of`: `finding`."""
        return self.finding

    def chance(self, task: str, summary: Any, records: Sequence[UnitRecord[Any]]) -> float | None:
        """See `Presenter.chance`: not known."""
        return None

    def is_share(self, metric: str, scores: Sequence[float]) -> bool:
        """See `Presenter.is_share`: a metric with a value below 0 or above 1 is none."""
        return all(0 <= score <= 1 for score in scores)

    def bounds(self, metric: str) -> tuple[float, float]:
        """See `Presenter.bounds`: none is known."""
        return -math.inf, math.inf

    def extra_scores(self, record: UnitRecord[Any]) -> Mapping[str, float]:
        """See `Presenter.extra_scores`: none."""
        return {}

    def extra_ranges(self, record: UnitRecord[Any]) -> Mapping[str, tuple[float, float]]:
        """See `Presenter.extra_ranges`: none."""
        return {}

    def explain(self, record: UnitRecord[Any]) -> Sequence[str]:
        """See `Presenter.explain`: nothing is known."""
        return ()

    def group(self, record: UnitRecord[Any]) -> str:
        """See `Presenter.group`: none."""
        return ""

    def group_scores(self, records: Sequence[UnitRecord[Any]]) -> Iterable[GroupScore]:
        """See `Presenter.group_scores`: none."""
        return ()

    def opening(self, runs: Sequence[Run]) -> Section | None:
        """See `Presenter.opening`: none."""
        return None

    def charts(self, runs: Sequence[Run]) -> Sequence[Chart]:
        """See `Presenter.charts`: none."""
        return ()

    def sections(self, runs: Sequence[Run]) -> Iterable[Section]:
        """See `Presenter.sections`: none."""
        return ()

    def describe(self, record: UnitRecord[Any]) -> Description:
        """See `Presenter.describe`: the unit's id."""
        return Description(record.id)

    def reply(self, record: UnitRecord[Any]) -> str:
        """See `Presenter.reply`: none, `details` has all fields."""
        return ""

    def reply_tokens(self, record: UnitRecord[Any]) -> ReplyTokens | None:
        """See `Presenter.reply_tokens`: none are known."""
        return None

    def details(self, record: UnitRecord[Any]) -> Mapping[str, str]:
        """See `Presenter.details`: the fields of the record's payload."""
        payload = record.payload
        fields = {
            field.name: getattr(payload, field.name) for field in msgspec.structs.fields(payload)
        }
        return {name: _text(value) for name, value in fields.items() if value is not None}

    def recalled(self, record: UnitRecord[Any]) -> Sequence[int | str]:
        """See `Presenter.recalled`: nothing."""
        return ()

    def steps(self, record: UnitRecord[Any]) -> Sequence[StepRow]:
        """See `Presenter.steps`: none."""
        return ()

    def request_frames(self, run: Run, data: Path | None) -> FindFrames:
        """See `Presenter.request_frames`: none."""
        return lambda _: ()

    def timelines(
        self, runs: Sequence[Run], data: Path | None, thumbnails: ThumbnailStore
    ) -> Timelines:
        """See `Presenter.timelines`: none."""
        return Timelines()


def _text(value: Any) -> str:
    text = (
        value
        if isinstance(value, str)
        else json.dumps(msgspec.to_builtins(value), ensure_ascii=False)
    )
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
