"""What any environment of plans must hold to: ours does, and broken ones are told what they
broke."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from infthor_eval.formats.trajectory import iter_trajectories
from infthor_eval.plans.check import check_env
from infthor_eval.plans.environment import Ended, PlanEnvironment
from infthor_eval.thor.frames import FrameFolder
from infthor_eval.thor.view import SimulatorView
from model_adapters import ContractError

from ..helpers.refusals import read_one_line
from ..helpers.trajectories import FORK, cut_trajectory, write_trajectories


@pytest.fixture
def trajectory(tmp_path):
    return next(iter_trajectories(write_trajectories(tmp_path / "data", cut_trajectory(FORK))))


@pytest.fixture
def environment(pool, trajectory, tmp_path):
    with pool.one(image=True, instances=False) as simulator:
        yield PlanEnvironment(trajectory, simulator, max_steps=12, frames=FrameFolder(tmp_path))


class Broken:
    """The environment, with a fault."""

    def __init__(self, environment):
        self._environment = environment
        self.plans = environment.plans
        self.expert_actions = environment.expert_actions

    def reset(self, plan=0):
        return self._environment.reset(plan)

    def step(self, action):
        return self._environment.step(action)


class Forgetful(Broken):
    def reset(self, plan=0):
        observation, info = super().reset(plan)
        return observation, {"max_reward": info["max_reward"]}


class Wandering(Broken):
    """Does not bring the agent back."""

    n_resets = 0

    def reset(self, plan=0):
        observation, info = super().reset(plan)
        self.n_resets += 1
        agent = observation.view.agent
        turned = msgspec.structs.replace(agent, rotation=agent.rotation + self.n_resets)
        return replace(observation, view=replace(observation.view, agent=turned)), info


class Flickering(Broken):
    n_resets = 0

    def reset(self, plan=0):
        observation, info = super().reset(plan)
        self.n_resets += 1
        dark = np.full_like(observation.view.frame, self.n_resets)
        return replace(observation, frame=None, view=replace(observation.view, frame=dark)), info


class Generous(Broken):
    def step(self, action):
        return super().step(action)._replace(reward=1.0)


class Infinite(Broken):
    def step(self, action):
        return super().step(action)._replace(reward=float("nan"))


class Undecided(Broken):
    def step(self, action):
        outcome = super().step(action)
        return outcome._replace(truncated=outcome.terminated)


class Lenient(Broken):
    """Goes on after what is no action."""

    def step(self, action):
        outcome = super().step(action)
        if outcome.info.ended == Ended.NO_ACTION:
            return outcome._replace(terminated=False, info=replace(outcome.info, ended=None))
        return outcome


class Eager(Broken):
    """Steps without a reset."""

    def step(self, action):
        try:
            return super().step(action)
        except RuntimeError:
            self._environment.reset(0)
            return super().step(action)


class Misnaming(Broken):
    def reset(self, plan=0):
        observation, info = super().reset(plan)
        objects = {key.replace("|", "_"): item for key, item in observation.view.objects.items()}
        return replace(observation, view=replace(observation.view, received=objects)), info


class Wrapping(Broken):
    def reset(self, plan=0):
        return super().reset(plan % len(self.plans))


BROKEN = {
    Forgetful: "the information of reset() lacks max_reward or n_expert",
    Wandering: "plan 1 begins in another state the second time",
    Flickering: "plan 1 begins with another picture the second time",
    Generous: "the expert earns 10 in plan 0, and max_reward says 6",
    Infinite: "a reward is nan",
    Undecided: "a plan is terminated and truncated at once",
    Lenient: "'', which is no action, does not terminate the plan",
    Eager: "step() before the first reset() does not raise RuntimeError",
    Misnaming: "the object Floor|+00.00|-00.10|+00.00 is kept as Floor_+00.00_-00.10_+00.00",
    Wrapping: "reset(-1) does not raise IndexError: no such plan",
}


def test_ours_keeps_the_contract(environment):
    check_env(environment, range(4))


@pytest.mark.parametrize("fault", BROKEN, ids=lambda fault: fault.__name__)
def test_a_broken_one_is_told_the_clause(environment, fault):
    with pytest.raises(ContractError) as caught:
        check_env(fault(environment), (0, 1) if fault is not Wandering else (1,))
    assert BROKEN[fault] in read_one_line(caught)


def test_without_frames_and_without_a_keeper_of_them_it_holds_too(pool, trajectory):
    with pool.one(image=False, instances=False) as simulator:
        environment = PlanEnvironment(trajectory, simulator, max_steps=12)
        check_env(environment, (2,))
        observation, _ = environment.reset(2)
        assert isinstance(observation.view, SimulatorView)
        assert (observation.frame, observation.view.frame) == (None, None)
