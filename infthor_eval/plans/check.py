"""The contract of an environment of plans, to check one's own: on another simulator, or on a robot.

It uses `reset`, `step` and the lists of plans and of the expert's actions alone. Each violated
clause raises an error of one line.
"""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from infthor_eval.formats.object_ids import object_type_of
from infthor_eval.plans.environment import Ended, Observation, StepOutcome
from infthor_eval.plans.expert import ExpertAction, ExpertRefusedError
from infthor_eval.plans.plan import Plan
from model_adapters.check.clauses import raises, require

_ID = re.compile(r"[A-Za-z]+\|[^|]+\|[^|]+\|[^|]+(\|\w+)*")  # type, position, part
_NONSENSE = ("", "fly to the moon", "MoveAhead Mug", "PutObject Mug", "pickupobject Mug")
_UNKNOWN = "PickupObject Unicorn"
_SMALL = 1e-6  # of rewards
_PLANS = 3  # number that is checked by default


class Environment(Protocol):
    """The interface that is checked; `PlanEnvironment` describes what each method returns."""

    @property
    def plans(self) -> Sequence[Plan]:
        """Plans that can be reset to."""

    def reset(self, plan: int = 0) -> tuple[Observation, Mapping[str, Any]]:
        """Bring the world to the true state before a plan."""

    def step(self, action: str | Mapping[str, Any]) -> StepOutcome:
        """Execute one action of the present plan."""

    def expert_actions(self, plan: int) -> Sequence[ExpertAction]:
        """Return the expert's actions of a plan."""


def check_env(environment: Environment, plans: Sequence[int] | None = None) -> None:
    """Check that an environment fulfils its contract.

    Args:
        environment: new environment with the default reward rules.
        plans: indices of the plans to check; None for the first ones. Those whose expert is refused
            are left out.

    Raises:
        ContractError: a clause does not hold; the message names it.
    """
    _check_plans(environment.plans)
    _check_nothing_under_way(environment, "before the first reset()")
    chosen = range(min(_PLANS, len(environment.plans))) if plans is None else plans
    possible = [plan for plan in chosen if not raises(ExpertRefusedError, environment.reset, plan)]
    require(bool(possible), "none of the plans can be reset to")
    for plan in possible:
        _check_reset(environment, plan)
        _check_expert(environment, plan)
    _check_state_is_the_plans_own(environment, possible)
    _check_nonsense(environment, possible[0])
    _check_limit(environment, possible[0])
    for plan in (-1, len(environment.plans)):
        require(
            raises(IndexError, environment.reset, plan),
            f"reset({plan}) does not raise IndexError: no such plan",
        )


def _check_plans(plans: Sequence[Plan]) -> None:
    require(bool(plans), "there is no plan")
    require(
        [plan.index for plan in plans] == list(range(len(plans))),
        "plans are not numbered in their order",
    )


def _check_nothing_under_way(environment: Environment, when: str) -> None:
    require(
        raises(RuntimeError, environment.step, "NoOp"), f"step() {when} does not raise RuntimeError"
    )


def _check_reset(environment: Environment, plan: int) -> None:
    result = environment.reset(plan)
    require(
        isinstance(result, tuple) and len(result) == 2,
        "reset() does not give an observation and information",
    )
    observation, info = result
    require(
        {"max_reward", "n_expert"} <= set(info),
        "the information of reset() lacks max_reward or n_expert",
    )
    most = info["max_reward"]
    require(math.isfinite(most) and most >= 0, f"max_reward of plan {plan} is {most}")
    n_expert = len(environment.expert_actions(plan))
    require(
        info["n_expert"] == n_expert > 0,
        f"n_expert of plan {plan} is {info['n_expert']}, of {n_expert} actions",
    )
    _check_observation(observation)


def _check_expert(environment: Environment, plan: int) -> None:
    """Check that the expert's actions complete a plan, and earn its highest possible reward."""
    _, info = environment.reset(plan)
    earned = 0.0
    over = False
    for action in environment.expert_actions(plan):
        outcome = environment.step(action.call)
        _check_outcome(outcome)
        earned += outcome.reward
        over = outcome.terminated or outcome.truncated
        if over:
            break
    done = over and outcome.info.ended == Ended.DONE
    require(done, f"the expert's actions do not complete plan {plan}: {outcome.info}")
    most = info["max_reward"]
    require(
        abs(earned - most) < _SMALL,
        f"the expert earns {earned:g} in plan {plan}, and max_reward says {most:g}",
    )
    _check_nothing_under_way(environment, "after a plan's end")


def _check_state_is_the_plans_own(environment: Environment, plans: Sequence[int]) -> None:
    """Check that a plan begins in the same state, whatever came before the reset."""
    first = {plan: environment.reset(plan) for plan in plans}
    for plan in (*reversed(plans), *plans):
        observation, info = environment.reset(plan)
        before, before_info = first[plan]
        is_same = _state(observation) == _state(before)
        require(is_same, f"plan {plan} begins in another state the second time")
        require(
            _same_picture(observation, before),
            f"plan {plan} begins with another picture the second time",
        )
        require(
            dict(info) == dict(before_info),
            f"the information of reset({plan}) differs the second time",
        )
        for action in ("RotateLeft", "LookUp"):
            if environment.step(action).terminated:
                break


def _check_nonsense(environment: Environment, plan: int) -> None:
    """Check that a text that is no action ends the plan, and earns nothing."""
    for text in (*_NONSENSE, _UNKNOWN):
        environment.reset(plan)
        outcome = environment.step(text)
        _check_outcome(outcome)
        require(outcome.terminated, f"{text!r}, which is no action, does not terminate the plan")
        require(outcome.reward == 0, f"{text!r}, which is no action, earns {outcome.reward}")
        expected = Ended.UNKNOWN_OBJECT if text == _UNKNOWN else Ended.NO_ACTION
        require(
            outcome.info.ended == expected,
            f"{text!r} ends the plan with {outcome.info.ended}, not {expected}",
        )
        require(outcome.info.call is None, f"{text!r}, which is no action, has a call")
        require(bool(outcome.info.message), f"{text!r}, which is no action, has no message")
        _check_nothing_under_way(environment, "after what is no action")


def _check_limit(environment: Environment, plan: int) -> None:
    """Check that a plan without progress is truncated."""
    environment.reset(plan)
    for _ in range(10_000):
        outcome = environment.step("NoOp")
        _check_outcome(outcome)
        if outcome.terminated or outcome.truncated:
            break
    require(outcome.truncated, "a plan in which nothing is done is not truncated")
    _check_nothing_under_way(environment, "after the limit of steps")


def _check_outcome(outcome: StepOutcome) -> None:
    require(isinstance(outcome, tuple) and len(outcome) == 5, "step() does not give five values")
    observation, reward, terminated, truncated, info = outcome
    require(
        isinstance(terminated, bool) and isinstance(truncated, bool),
        "terminated and truncated are no booleans",
    )
    require(not (terminated and truncated), "a plan is terminated and truncated at once")
    require(isinstance(reward, int | float) and math.isfinite(reward), f"a reward is {reward!r}")
    goes_on = not terminated and not truncated
    require((info.ended is None) == goes_on, f"info.ended is {info.ended} at the wrong time")
    require(
        (info.ended == Ended.LIMIT) == truncated,
        f"truncated is {truncated}, and info.ended is {info.ended}",
    )
    _check_observation(observation)


def _check_observation(observation: Observation) -> None:
    view = observation.view
    for key, thor_object in view.objects.items():
        object_id = thor_object.object_id
        object_type = thor_object.object_type
        require(key == object_id, f"the object {object_id} is kept as {key}")
        require(bool(_ID.fullmatch(key)), f"{key!r:.80} is no id of the form Type|x|y|z")
        named = object_type_of(key)
        problem = f"{key} says that it is a {named}, and is a {object_type}"
        require(named == object_type, problem)
    for key in view.inventory:
        require(key in view.objects, f"{key}, which is held, is not among the objects")
    if view.frame is not None:
        shape = view.frame.shape
        kind = view.frame.dtype
        require(kind == np.uint8, f"a frame is of {kind}, not of bytes")
        require(
            len(shape) == 3 and shape[2] == 3,
            f"a frame has the shape {shape}, not (height, width, 3)",
        )
    if observation.frame is not None and view.frame is not None:
        kept = np.asarray(observation.frame.load())
        require(
            np.array_equal(kept, view.frame),
            f"{observation.frame.path} is another picture than the view's",
        )


def _state(observation: Observation) -> tuple[Any, ...]:
    return observation.view.agent, observation.view.inventory, observation.view.objects


def _same_picture(one: Observation, other: Observation) -> bool:
    if one.view.frame is None or other.view.frame is None:
        return one.view.frame is other.view.frame
    return np.array_equal(one.view.frame, other.view.frame)
