"""What presenters of suites return: for the report's page, as figures and as recordings.

`infthor_eval.suites.find_presenter` finds the presenter of a suite; the base of all, which serves
suites that have none, is `report.plain.PlainPresenter`.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from PIL import Image

from infthor_eval.formats.frames import FrameRef
from infthor_eval.report.web.samples import FrameFacts, Timeline
from infthor_eval.run import Run
from infthor_eval.runs import UnitKey, UnitRecord
from infthor_eval.tables import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure as MatplotlibFigure

Record = UnitRecord[Any]
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


class OpenReplay(Protocol):
    """A simulator in which recorded episodes of one trajectory are replayed."""

    @property
    def n_episodes(self) -> int:
        """Number of episodes of the trajectory."""

    def frames(self, records: Sequence[Record], /) -> Iterator[Any]:
        """Replay episodes and yield their states: the start of each, then one per step.

        Each has `observation`, the world at that state, with `frame` (uint8 RGB array), which is
        None if nobody acted in it; and `note`, how the replay differs from the recorded episode,
        which is empty if it does not.

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


@dataclass(frozen=True)
class Replay:
    """How recorded episodes are replayed and drawn.

    Attributes:
        unit: what an episode is called, in the plural.
        options: options of `watch` that this suite supports besides those of all suites.
        select: finds the selected episodes in a run. It raises UsageError if the run has no such
            episodes, or the selection is ambiguous; DataError if the run has no episodes, or its
            header is not one of this suite.
        draw_map: draws an observation from above, as a square of so many pixels.
        pictures: draws frames as pictures of a film, all of one size, with a heading.
        draw_sheet: draws frames as one picture with a row per episode; None if there are no sheets.
        sheet_rows: maximum number of episodes on a sheet.
    """

    unit: str
    options: Collection[str]
    select: Callable[[Run, EpisodeSelection], Recording]
    draw_map: Callable[[Any, int], Image.Image]
    pictures: Callable[[Iterable[Any], str], Iterator[Image.Image]]
    draw_sheet: Callable[[Iterable[Any], str], Image.Image] | None = None
    sheet_rows: int = 0
