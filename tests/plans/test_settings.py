"""Settings of task files act, or are refused."""

import json
from collections import Counter
from pathlib import Path

import pytest

from infthor_eval.errors import DataError, UsageError
from infthor_eval.runs import execute

from ..helpers.refusals import assert_raises_one_line
from ..helpers.trajectories import CANDLE, FORK, cut_trajectory, write_trajectories
from .outcomes import payloads

pytestmark = pytest.mark.usefixtures("shared_simulators")


SETTINGS = [
    ("plan: all", "dataset_kwargs: plan is not known; did you mean plans?"),
    (
        "colour: red",
        "dataset_kwargs: colour is not known; there are after_failure, bundled",
    ),
    ("plans: some", "dataset_kwargs: plans is 'some'; it is all or final"),
    ("after_failure: weep", "dataset_kwargs: after_failure is 'weep'; it is continue or stop"),
    ("max_steps: 0", "dataset_kwargs: max_steps is 0; it is a whole number from 1"),
    ("max_steps: true", "dataset_kwargs: max_steps is True; it is a whole number from 1"),
    ("max_steps: 2.5", "dataset_kwargs: max_steps is 2.5; it is a whole number from 1"),
    ("preamble: 7", "dataset_kwargs: preamble is 7; it is a text"),
    ("rewards: generous", "rewards is 'generous'; it is default or published"),
    (
        "history: all",
        "history all: there are full, published, last:TOKENS, text, retrieved:K, frames:K, memory, "
        "goals and plans",
    ),
    ("bundled: nothing", "the installation lacks its data folder 'sets/nothing'"),
]


@pytest.fixture
def task_file(task_files: Path):
    """Has `infthor_plans` say something else."""

    def write_task(settings, more=""):
        (task_files / "plans" / "infthor_plans.yaml").write_text(
            f"include: _plans.yaml\ntask: infthor_plans\ndataset_kwargs: {{{settings}}}\n{more}"
        )

    return write_task


@pytest.mark.parametrize(
    ("settings", "expected"), SETTINGS, ids=[expected for _, expected in SETTINGS]
)
def test_a_setting_that_would_not_act_is_refused(prepare_run, task_file, settings, expected):
    task_file(settings)
    assert_raises_one_line(prepare_run, expected, (DataError, UsageError))


def test_settings_of_a_task_file_act_and_options_go_before_them(prepare_run, task_file):
    task_file("max_steps: 2, rewards: published")
    plans = payloads(execute(prepare_run()))
    ends = Counter(plan.ended for plan in plans)
    assert ends == {"step limit": 1, "done": 2, "refused by the simulator": 1}
    plans = payloads(execute(prepare_run(rewards="default")))
    assert Counter(plan.ended for plan in plans) == {"step limit": 2, "done": 2}


DRAWN = "dataset_kwargs: {}\ngeneration_kwargs: "


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        ("", "no dataset_kwargs; tasks of plans need dataset_kwargs, generation_kwargs"),
        ("dataset_kwargs: 5", "dataset_kwargs must be a mapping of settings"),
        (f"{DRAWN}{{max_gen_toks: 0}}", "max_new_tokens must be at least 1, not 0"),
        (f"{DRAWN}{{max_gen_toks: 9, beams: 2}}", "generation_kwargs: beams is not known"),
        (f"{DRAWN}7", "generation_kwargs is 7; it is a mapping of settings"),
    ],
)
def test_what_is_wrong_beside_the_settings_is_refused_too(prepare_run, task_files, more, expected):
    (task_files / "plans" / "infthor_plans.yaml").write_text(
        f"include: _plans.yaml\ntask: infthor_plans\n{more}\n"
    )
    assert_raises_one_line(lambda: prepare_run(data=None), expected)


def test_another_setting_is_another_run(prepare_run, data):
    def identity(**changes):
        run = prepare_run(**changes)
        return run.evaluation.bind(run.suite.baselines["planner"](0)).workload.config

    plain = identity()
    changes = {"rewards": "published", "words": "natural", "force_action": True}
    changes |= {"history": "published", "after_failure": "stop", "constrained": True}
    changes |= {"greedy": True, "frames": "blank"}
    for name, value in changes.items():
        assert identity(**{name: value}) != plain
    assert identity(history="last:100") != plain
    final = write_trajectories(data.parent / "final", cut_trajectory(CANDLE, 2, final=True))
    assert identity(tasks=("infthor_final",), data=final) != plain
    document = cut_trajectory(FORK)
    document["plan"]["low_actions"].pop()
    (data / f"{FORK}.json").write_text(json.dumps(document))
    assert identity() != plain
