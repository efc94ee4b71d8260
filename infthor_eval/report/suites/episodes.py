"""Columns of plans and of episodes of arms in the table of samples."""

from operator import attrgetter

from infthor_eval.report.sample_columns import SampleColumn, payload_column

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
