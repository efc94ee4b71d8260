"""Rules of rewards: the numbers and choices of `rewards.yaml`."""

from pathlib import Path
from typing import Any, Literal

import msgspec

from infthor_eval.errors import unknown_name
from infthor_eval.formats.yaml_files import read_yaml
from infthor_eval.plans.plan import PlanKind

_FILE = Path(__file__).with_name("rewards.yaml")


class RewardRules(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A set of rules, as in `rewards.yaml`.

    Attributes:
        scoring: who rewards actions: "default" (`rewards`) or "published" (`published.rewards`).
        grounding: how a name becomes an object: "strict" (`thor.actions`) or "published"
            (`plans.published.script`).
        force_action: whether calls of agents have `forceAction`, with which held objects never
            block a move.
        task_done: reward when the goal of the plan's task is reached.
        per_step: reward of GotoLocation per step of the shortest path gained.
        nearer_than: number of remaining steps below which GotoLocation is done.
        look_degrees: angle of one LookUp or LookDown.
        rewards: reward per success, by kind.
        valid_actions: actions that are valid for a kind, by AI2-THOR's names.
        version: number of the rules as code; another one when that gives other rewards.
    """

    scoring: Literal["default", "published"]
    grounding: Literal["strict", "published"]
    force_action: bool
    task_done: float
    per_step: float
    nearer_than: int
    look_degrees: float
    rewards: dict[PlanKind, float]
    valid_actions: dict[PlanKind, frozenset[str]]
    version: int = 1

    def forcing(self) -> "RewardRules":
        """Return the same rules with `force_action`."""
        return msgspec.structs.replace(self, force_action=True)

    def document(self) -> dict[str, Any]:
        """Return the rules as JSON values, for run configs."""
        document: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(self, order="sorted"))
        return document


def reward_rules(name: str) -> RewardRules:
    """Return the rules "default" or "published"; UsageError for other names."""
    by_name = read_yaml(_FILE, "install the package again")
    if name not in by_name:
        raise unknown_name("reward rules", name, by_name)
    return msgspec.convert(by_name[name], RewardRules)
