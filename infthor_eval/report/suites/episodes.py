"""What plans and episodes of arms have alike: their presenters' base, and columns of samples."""

import math
from collections.abc import Mapping, Sequence
from operator import attrgetter
from typing import Any

from infthor_eval.pairs import PAIR_BOUNDS
from infthor_eval.report.plain import PlainPresenter
from infthor_eval.report.sample_columns import SampleColumn, payload_column
from infthor_eval.runs import UnitRecord

_EPISODE_COLUMNS = (
    payload_column("index", int),
    payload_column("kind", str),
    payload_column("ended", str),
    payload_column("attempted", bool),
    SampleColumn("n_steps", int, lambda record: len(record.payload.steps)),
    payload_column("max_reward", float),
)

PLAN_COLUMNS = (
    *_EPISODE_COLUMNS,
    payload_column("plan", str),
    payload_column("goal", str),
    SampleColumn("task_index", int, attrgetter("payload.task")),
    payload_column("first_step", int),
    payload_column("n_expert_steps", int),
    payload_column("is_final", bool),
    payload_column("expert_reward", float),
    payload_column("goal_reached", bool),
    SampleColumn(
        "n_conditions_met", int, lambda record: (record.payload.conditions or (None, None))[0]
    ),
    SampleColumn(
        "n_conditions", int, lambda record: (record.payload.conditions or (None, None))[1]
    ),
    payload_column("clue_distance", int),
    payload_column("clue_tokens", int),
)

ARM_COLUMNS = (
    *_EPISODE_COLUMNS,
    payload_column("instruction", str),
    payload_column("object_id", str),
    payload_column("receptacle_id", str),
    payload_column("starts_inside", bool),
    payload_column("start_distance", float),
    payload_column("closest", float),
    payload_column("n_collisions", int),
)


class EpisodesPresenter(PlainPresenter):
    """See `PlainPresenter`."""

    reply_label = "ended"
    main_metric = "success"

    def is_share(self, metric: str, scores: Sequence[float]) -> bool:
        """See `PlainPresenter.is_share`."""
        return metric == self.main_metric or metric in PAIR_BOUNDS

    def bounds(self, metric: str) -> tuple[float, float]:
        """See `PlainPresenter.bounds`: only rewards have none."""
        return (-math.inf, math.inf) if metric == "reward" else PAIR_BOUNDS.get(metric, (0.0, 1.0))

    def reply(self, record: UnitRecord[Any]) -> str:
        """See `PlainPresenter.reply`: how the episode ended."""
        ended: str = record.payload.ended
        return ended

    def details(self, record: UnitRecord[Any]) -> Mapping[str, str]:
        """See `PlainPresenter.details`: the page shows all of it elsewhere."""
        return {}
