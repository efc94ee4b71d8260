"""What the evaluations of plans and of arms have in common."""

from pathlib import Path

import pytest

from infthor_eval.errors import DataError
from infthor_eval.formats.trajectory import iter_sources
from infthor_eval.manipulation.evaluation import ManipulationEvaluation
from infthor_eval.manipulation.options import ManipulationOptions
from infthor_eval.manipulation.trajectories import read_arm_trajectory
from infthor_eval.plans.evaluation import PlansEvaluation
from infthor_eval.plans.options import PlansOptions
from infthor_eval.runs import TaskFile, TaskRequest

from ..helpers.trajectories import CANDLE, MUG, cut_trajectory, write_trajectories

KWARGS = {"dataset_kwargs": {}, "generation_kwargs": {"max_gen_toks": 1}}


@pytest.mark.parametrize(
    ("suite", "evaluation", "options"),
    [
        ("plans", PlansEvaluation, PlansOptions()),
        ("manipulation", ManipulationEvaluation, ManipulationOptions()),
    ],
)
def test_a_limit_changes_neither_floor_plans_nor_what_baselines_learn_from(
    tmp_path, suite, evaluation, options
):
    data = write_trajectories(tmp_path / "data", cut_trajectory(CANDLE), cut_trajectory(MUG))
    file = TaskFile("a_task", suite, Path("a_task.yaml"), KWARGS)
    limited, unlimited = (
        evaluation(TaskRequest([file], options, data, limit)) for limit in (1, None)
    )
    assert (
        len({unit.cluster for unit in limited.units})
        == 1
        < len({unit.cluster for unit in unlimited.units})
    )
    assert limited.trajectories == unlimited.trajectories


def test_an_action_without_an_object_is_named_with_its_file(tmp_path):
    data = write_trajectories(tmp_path / "data", cut_trajectory(MUG))
    (path,) = data.iterdir()
    text = path.read_text()
    assert '"objectId"' in text
    path.write_text(text.replace('"objectId"', '"nothing"'))
    (source,) = iter_sources(path)
    with pytest.raises(
        DataError, match=rf"{path.name}.*: action \d+ \(PickupObject\) names no object"
    ):
        read_arm_trajectory(source)
