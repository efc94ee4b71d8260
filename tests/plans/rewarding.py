"""Plans in the kitchen by hand, and what each action gives in them."""

from infthor_eval.household.tasks import Task, TaskType
from infthor_eval.household.treatments import Treatments
from infthor_eval.plans.plan import PlanKind
from infthor_eval.plans.reward_rules import reward_rules
from infthor_eval.plans.rewards import PlanReward
from infthor_eval.plans.targets import PlanTarget

from .building import BASIN, FAUCET, FRIDGE, MICROWAVE, MUG, OTHER_TABLE, TOILET, kitchen

DEFAULT = reward_rules("default")
ELSEWHERE = Task(TaskType.PLACE, "Mug", "Desk")  # there is no desk: never done
GOES_ON, DONE, FAILED = "goes on", "done", "failed"


def run(rules, target, start, events, task=ELSEWHERE, grid=None, treatments=None):
    """What each event gives: (reward, how it leaves the plan)."""
    plan = PlanReward(rules, target, task, start, treatments or Treatments(), grid)
    before, rewards = start, []
    for action, object_id, after in events:
        step = plan.after({"action": action, "objectId": object_id}, before, after)
        assert not (step.done and step.failed)
        rewards.append((step.reward, DONE if step.done else FAILED if step.failed else GOES_ON))
        before = after
    return rewards


def check(target, start, steps, task=ELSEWHERE, **more):
    """Hold that each step (action, object, world after it, reward, how it leaves the plan) gives
    what is said; where nothing is said, nothing is given and the plan goes on."""
    expected = [(*step[3:], *(0.0, GOES_ON)[len(step) - 3 :]) for step in steps]
    assert run(DEFAULT, target, start, [step[:3] for step in steps], task, **more) == expected


PICKUP = PlanTarget(PlanKind.PICKUP, MUG)
PUT = PlanTarget(PlanKind.PUT, MUG, OTHER_TABLE)
ON_THE_LID = PlanTarget(PlanKind.PUT, MUG, TOILET)
STOW = PlanTarget(PlanKind.PUT, MUG, FRIDGE)
CLEAN = PlanTarget(PlanKind.CLEAN, MUG, BASIN)
HEAT = PlanTarget(PlanKind.HEAT, MUG, MICROWAVE)
COOL = PlanTarget(PlanKind.COOL, MUG, FRIDGE)

HOLDING = kitchen(held=MUG)
OPEN_FRIDGE = kitchen(held=MUG, opened=[FRIDGE])
IN_FRIDGE = kitchen({MUG: FRIDGE}, opened=[FRIDGE])
STOWED = kitchen({MUG: FRIDGE})
IN_SINK = kitchen({MUG: BASIN})
WASHED = kitchen({MUG: BASIN}, on=[FAUCET])
