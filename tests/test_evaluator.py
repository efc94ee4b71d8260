"""`Evaluator` and `evaluate` with models and policies that are objects."""

import pytest

import infthor_eval
from infthor_eval import Evaluator
from infthor_eval.errors import ModelError, UsageError
from infthor_eval.thor.simulator import Simulator
from model_adapters import ArmDelta, Capabilities, load


class Counting:
    """A policy that closes its hand where it is, and counts its episodes."""

    name = "counting"
    capabilities = Capabilities(counts_tokens=False, token_ids=False)

    def __init__(self):
        self.n_episodes = 0
        self.is_closed = False

    def identity(self):
        return {}

    def reset(self):
        self.n_episodes += 1

    def act(self, frame, instruction):
        return (ArmDelta((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0),)

    def close(self):
        self.is_closed = True


def test_an_object_is_evaluated_again_and_again_in_the_same_simulators(tmp_path, monkeypatch):
    started = []
    begin = Simulator.__init__
    monkeypatch.setattr(
        Simulator, "__init__", lambda self, *a, **k: (started.append(self), begin(self, *a, **k))[1]
    )
    policy = Counting()
    with Evaluator("manipulathor_pickup_mini", limit=2, out=str(tmp_path)) as evaluator:
        scores = [evaluator(policy, name=f"step-{step}") for step in range(2)]
        n_started = len(started)
        scores.append(evaluator(policy, name="step-1"))  # another run of the name
    assert scores[0] == scores[1] == scores[2]
    assert set(scores[0]) == {"manipulathor_pickup_mini"}
    assert policy.n_episodes == 6
    assert len(started) == n_started == 2  # the expert's and the arm's
    assert all(simulator._controller is None for simulator in started)
    assert not policy.is_closed
    runs = infthor_eval.load_runs(tmp_path)
    assert sorted(runs.run) == ["step-0", "step-1"]
    again = infthor_eval.evaluate(
        policy, "manipulathor_pickup_mini", limit=2, out=tmp_path / "once"
    )
    assert again.score[0] == scores[0]["manipulathor_pickup_mini"]


def test_an_object_that_is_no_policy_is_refused(tmp_path):
    with (
        Evaluator("manipulathor_pickup_mini", limit=1, out=str(tmp_path)) as evaluator,
        pytest.raises(UsageError, match="which needs a policy that drives an arm"),
    ):
        evaluator(load("qwen2.5-vl-tiny", {}, 0))


class Failing(Counting):
    """Fails in some episodes, by their numbers."""

    name = "failing"

    def __init__(self, fails):
        super().__init__()
        self.fails = fails

    def act(self, frame, instruction):
        if self.n_episodes in self.fails:
            raise RuntimeError("no more hands")
        return super().act(frame, instruction)


def test_units_that_fail_are_told(tmp_path):
    with Evaluator("manipulathor_pickup_mini", limit=2, out=str(tmp_path)) as evaluator:
        with pytest.warns(UserWarning, match=r"1 of 2 units failed: .*no more hands"):
            evaluator(Failing({1}))
        with pytest.raises(ModelError, match=r"all 2 units failed: .*hands.*fix the adapter"):
            evaluator(Failing({1, 2}))
        with pytest.raises(UsageError, match="give an object"):
            evaluator("blind")
    with pytest.raises(UsageError, match="in a block"):
        evaluator(Counting())
    with pytest.raises(UsageError, match="is called with the model"):
        Evaluator("manipulathor_pickup_mini", model="still")
