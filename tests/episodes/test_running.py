"""Records of episodes, whatever becomes of them, without a simulator."""

import time
from types import SimpleNamespace

import msgspec
import pytest

from infthor_eval.episodes.records import InfeasibleError
from infthor_eval.episodes.running import EpisodeResult, EpisodeRunner
from infthor_eval.errors import ModelError, SceneError, SimulatorError
from infthor_eval.manipulation.records import ArmRecord
from infthor_eval.runs import Tokens, Unit, UnitKey, Usage

UNIT = Unit(
    UnitKey("task", "a/0001"), "a", ArmRecord(index=1, kind="put", instruction="put it down")
)
BEGUN = msgspec.structs.replace(UNIT.payload, object_id="Mug|1", start_distance=0.5)
SESSION = SimpleNamespace(describe_failure=lambda unit, error: str(error))
DONE = msgspec.structs.replace(BEGUN, ended="done")


@pytest.fixture
def runner():
    worlds = iter(range(9))
    return EpisodeRunner(SimpleNamespace(restarts=0), lambda: next(worlds))


def record(runner, *outcomes):
    """The record of an episode whose tries end so."""
    left = list(outcomes)

    def run():
        assert runner.environment == len(outcomes) - len(left)  # a new one for each try
        runner.begun, runner.usage = BEGUN, Usage.total([runner.usage, Usage(1)])
        outcome = left.pop(0)
        if isinstance(outcome, Exception):
            raise outcome
        return outcome

    return runner.record(UNIT, "print", run, SESSION)


def test_a_result_has_its_tokens_its_usage_and_the_faults_of_simulator_and_model(runner):
    result = record(
        runner, SimulatorError("it hangs"), EpisodeResult(DONE, Tokens(context=7), ("asked again",))
    )
    assert (result.payload, result.tokens, result.fingerprint) == (DONE, Tokens(context=7), "print")
    assert result.faults == ("it hangs", "asked again")
    assert result.usage == Usage(2)  # the try that failed has its share


def test_the_time_of_tries_that_fail_counts(runner):
    def run():
        time.sleep(0.02)
        if not runner.begun:
            runner.begun = BEGUN
            raise SimulatorError("it hangs")
        return EpisodeResult(DONE)

    assert runner.record(UNIT, "", run, SESSION).seconds >= 0.04


def test_a_subject_that_fails_leaves_what_was_known_of_the_episode_when_it_began(runner):
    failed = record(runner, ModelError("out of memory"))
    assert (failed.failure, failed.payload, failed.usage) == ("out of memory", BEGUN, Usage(1))
    runner.begun = BEGUN  # of the episode before
    with_nothing = runner.record(
        UNIT, "", lambda: (_ for _ in ()).throw(ModelError("at once")), SESSION
    )
    assert (with_nothing.failure, with_nothing.payload) == ("at once", UNIT.payload)


@pytest.mark.parametrize(
    "error", [InfeasibleError("the expert is refused"), SceneError("no such scene")]
)
def test_what_is_infeasible_is_excluded(runner, error):
    excluded = record(runner, error)
    assert (excluded.excluded, excluded.failure, excluded.payload) == (
        str(error),
        None,
        UNIT.payload,
    )


def test_a_simulator_that_fails_every_time_is_a_failure(runner):
    failed = record(runner, *(SimulatorError(f"it hangs ({number})") for number in range(3)))
    assert (failed.failure, failed.usage) == ("it hangs (2)", Usage(3))
