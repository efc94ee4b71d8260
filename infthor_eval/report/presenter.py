"""How the results of a suite are presented: on the report's page, as figures and as recordings.

`infthor_eval.suites.find_presenter` finds the presenter of a suite; `PlainPresenter` serves suites
that have none.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from PIL import Image

from infthor_eval.formats.frames import FrameRef
from infthor_eval.report.charts import Chart
from infthor_eval.report.descriptions import Description, StepRow
from infthor_eval.report.sample_columns import SampleColumn
from infthor_eval.report.web.samples import FrameFacts, Timeline
from infthor_eval.report.web.sections import Section
from infthor_eval.report.web.thumbnails import ThumbnailStore
from infthor_eval.run import Run
from infthor_eval.runs import UnitKey, UnitRecord
from infthor_eval.tables import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure as MatplotlibFigure

Record = UnitRecord[Any]
# Of twins, in any suite.
NET_PAIRS = "net pairs"
PAIRS_FINDING = "has {} net pairs"
FindFrames = Callable[[Record], Sequence[FrameRef]]


class ReplyTokens(NamedTuple):
    """The tokens of a reply.

    Attributes:
        ids: their ids.
        margins: how much likelier the likeliest token was than the second, at each of them and at
            the one that ends the reply, in nats.
    """

    ids: Sequence[int]
    margins: Sequence[float]


class GroupScore(NamedTuple):
    """The score of a group of records, such as both replies to a pair of twins.

    Attributes:
        metric: name of the metric.
        group: name of the group, by which runs are paired.
        cluster: what the group's interval clusters by.
        score: the score, over the group's repetitions.
    """

    metric: str
    group: str
    cluster: str
    score: float


class Timelines(NamedTuple):
    """Frames that samples are about.

    Attributes:
        by_unit: timeline of each unit that has one.
        notes: reasons why frames are missing, a line each.
        facts: what is known of frames, by the numbers that the timelines' frames have for it.
    """

    by_unit: Mapping[UnitKey, Timeline] = {}
    notes: Sequence[str] = ()
    facts: Sequence[FrameFacts] = ()


@dataclass(frozen=True)
class FigureRequest:
    """Options of `report --figure`.

    Attributes:
        task: name of the task to draw, or names separated by commas; None for what the runs share.
        panels: YAML file with the runs of each panel; None draws all runs in one.
    """

    task: str | None = None
    panels: Path | None = None


@dataclass(frozen=True)
class FigureResult:
    """A figure, ready to be drawn.

    Attributes:
        table: the numbers of the figure.
        plot: draws it with matplotlib, in whatever style is in effect (`report.figures`).
        notes: remarks to print below the table, a line each.
    """

    table: Table
    plot: "Callable[[], MatplotlibFigure]"
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Figure:
    """A figure that can be drawn from runs of a suite.

    Attributes:
        about: contents of the figure, in words.
        build: builds the figure of some runs, which are all of the suite.
        has_panels: whether runs can be assigned to panels.
    """

    about: str
    build: Callable[[Sequence[Run], FigureRequest], FigureResult]
    has_panels: bool = True


@dataclass(frozen=True)
class EpisodeSelection:
    """The episodes of a run to replay; None: all, or the only one where one is needed.

    Attributes:
        task: name of a task of the run.
        trajectory: name of a trajectory of the run.
        plans: numbers of plans, "7" or "3-7".
        episode: numbers of expert actions, "17" or "17,75".
        most: maximum number of episodes, chosen evenly if there are more; None for no maximum.
    """

    task: str | None = None
    trajectory: str | None = None
    plans: str | None = None
    episode: str | None = None
    most: int | None = None


class ReplayFrame(Protocol):
    """A state of a replayed episode: its start, or the result of a step."""

    @property
    def observation(self) -> Any:
        """The world at that state, with `frame` (uint8 RGB array); None if nobody acted in it."""

    @property
    def note(self) -> str:
        """How the replay differs from the recorded episode; empty if it does not."""


class OpenReplay(Protocol):
    """A simulator in which recorded episodes of one trajectory are replayed."""

    @property
    def n_episodes(self) -> int:
        """Number of episodes of the trajectory."""

    def frames(self, records: Sequence[Record], /) -> Iterator[Any]:
        """Replay episodes and yield `ReplayFrame`s: the start of each, then one per step.

        Raises:
            InfthorError: an episode cannot be replayed.
        """


@dataclass(frozen=True)
class Recording:
    """The recorded episodes of one trajectory that were selected.

    Attributes:
        trajectory: name of the trajectory.
        tasks: names of the tasks that have episodes of it.
        records: records of the selected episodes, in time order.
        simulator: name of the run's simulator.
        open: opens a simulator like the run's; takes the folder or file of the trajectories and the
            folder of recorded floor plans, each None if the run did not need it.
    """

    trajectory: str
    tasks: Sequence[str]
    records: Sequence[Record]
    simulator: str
    open: Callable[[Path | None, Path | None], AbstractContextManager[OpenReplay]]


class Replay(Protocol):
    """Replays recorded episodes and draws them.

    Attributes:
        unit: what an episode is called, in the plural.
        options: options of `watch` that this suite supports besides those of all suites.
        sheet_rows: maximum number of episodes on a sheet; 0 if there are no sheets.
    """

    unit: str
    options: Collection[str]
    sheet_rows: int

    def select(self, run: Run, selection: EpisodeSelection) -> Recording:
        """Find the selected episodes in a run.

        Raises:
            UsageError: the run has no such episodes, or the selection is ambiguous.
            DataError: the run has no episodes, or its header is not one of this suite.
        """

    def draw_map(self, observation: Any, size: int) -> Image.Image:
        """Draw an observation from above, as a square of `size` pixels."""

    def pictures(self, frames: Iterable[Any], heading: str) -> Iterator[Image.Image]:
        """Draw the frames as pictures of a film, all of one size, with a heading."""

    def draw_sheet(self, frames: Iterable[Any], heading: str) -> Image.Image:
        """Draw the frames as one picture with a row per episode."""


class Presenter(Protocol):
    """How results of a suite are presented.

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

    title: str
    measure: str
    finding: str
    target_label: str
    reply_label: str
    member_label: str
    main_metric: str | None
    compares_scorers: bool
    replay: Replay | None
    figures: Mapping[str, Figure]
    columns: Sequence[SampleColumn]

    def measure_of(self, task: str, summary: Any) -> str:
        """Return what the primary metric of a task measures, by the suite's summary of a run;
        `measure`, unless tasks of the suite measure different things."""

    def finding_of(self, task: str, summary: Any) -> str:
        """Return `finding`, as `measure_of` returns `measure`."""

    def chance(self, task: str, summary: Any, records: Sequence[Record]) -> float | None:
        """Return what `blind`, which sees no frame, scores in the primary metric of a task, on its
        answered records, 0 to 1; None if that is not known."""

    def is_share(self, metric: str, scores: Sequence[float]) -> bool:
        """Whether a metric with these scores is a share, which is shown in percent; others are
        shown as they are."""

    def bounds(self, metric: str) -> tuple[float, float]:
        """Return the lowest and the highest possible score of a metric, one of `extra_scores` or
        `group_scores` included; infinite where there is no limit, or none is known."""

    def extra_scores(self, record: Record) -> Mapping[str, float]:
        """Return scores that only some samples have, by name; runs are compared on those."""

    def extra_ranges(self, record: Record) -> Mapping[str, tuple[float, float]]:
        """Return the lowest and the highest possible value of each of `extra_scores`."""

    def explain(self, record: Record) -> Sequence[str]:
        """Return why the reply of a record got its scores, a line each."""

    def group(self, record: Record) -> str:
        """Return the name of the record's group, which is one sample and right if all of it is.

        A group is of one task, variant and repetition. Empty for a record that is a sample by
        itself.
        """

    def group_scores(self, records: Sequence[Record]) -> Iterable[GroupScore]:
        """Return the scores of the groups in a run's records of a task; runs are compared on
        them."""

    def opening(self, runs: Sequence[Run]) -> Section | None:
        """Build the section that comes before the suite's own, with charts and tables of its own;
        tables of the suite that it has are not shown again."""

    def charts(self, runs: Sequence[Run]) -> Sequence[Chart]:
        """Draw the charts of the suite's section; its tables are `Suite.tables`."""

    def sections(self, runs: Sequence[Run]) -> Iterable[Section]:
        """Build further sections, which follow the suite's own."""

    def describe(self, record: Record) -> Description:
        """Describe the sample of a record."""

    def reply(self, record: Record) -> str:
        """Return the reply of a record; empty if there is none."""

    def reply_tokens(self, record: Record) -> ReplyTokens | None:
        """Return the tokens of the reply; None if they were not recorded."""

    def details(self, record: Record) -> Mapping[str, str]:
        """Return further facts about a record, by name."""

    def recalled(self, record: Record) -> Sequence[int | str]:
        """Return what a memory recalled for a record: places of frames in the trajectory, and
        texts; empty without a memory."""

    def steps(self, record: Record) -> Sequence[StepRow]:
        """Return the steps of a recorded episode; empty if it has none."""

    def request_frames(self, run: Run, data: Path | None) -> FindFrames:
        """Return what finds the frames of a record's request (`prompts`), in their order; it raises
        DataError where they cannot be found."""

    def timelines(
        self, runs: Sequence[Run], data: Path | None, thumbnails: ThumbnailStore
    ) -> Timelines:
        """Find the samples' frames; `data` is the set's folder, None for the one a run names."""
