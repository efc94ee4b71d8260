"""Plans as a journal has them: numbers that cannot be summed up are refused as the line is read."""

import json

import msgspec
import pytest

from infthor_eval.plans.records import PlanRecord

PLAN = {"type": "plan", "index": 0, "kind": "GotoLocation", "plan": "go to the mug", "goal": ""}
PLAN |= {"task": 0, "first_step": 0, "n_expert_steps": 3}


@pytest.mark.parametrize(
    "wrong",
    [
        {"n_expert_steps": 10**400},
        {"n_expert_steps": -1},
        {"clue_tokens": 2**53 + 1},
        {"conditions": [1, 0]},
        {"conditions": [1, 2**63]},
        {"steps": [{"n_context_tokens": 10**30}]},
    ],
)
def test_a_count_that_is_none_is_refused(wrong):
    assert msgspec.json.decode(json.dumps(PLAN), type=PlanRecord).n_expert_steps == 3
    with pytest.raises(msgspec.ValidationError):
        msgspec.json.decode(json.dumps(PLAN | wrong), type=PlanRecord)
