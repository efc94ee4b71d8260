"""Episodes one at a time: what a harness that steps through them finds is what our own run does."""

import pytest

from infthor_eval.errors import DataError, SimulatorError, UsageError
from infthor_eval.manipulation.environment import ArmEnvironment
from infthor_eval.manipulation.task import ManipulationTask
from infthor_eval.manipulation.worlds import ArmWorld, arm_evaluation
from model_adapters import ArmDelta
from tests.helpers.command_line import option_words
from tests.helpers.journals import read_records

TASKS = "manipulathor_pickup,manipulathor_put"
SHORT = "max_steps: 2, image_size: 64"
OPENS = ArmDelta((0.03, 0.0, 0.02), (0.0, 0.1, 0.0), 1.0)


@pytest.fixture
def open_world(data):
    """Opens the world of the tasks on a mug that is picked up and put; it is closed afterwards."""
    opened = []

    def open_world(task=TASKS):
        opened.append(ArmWorld(arm_evaluation(task, str(data))))
        return opened[-1]

    yield open_world
    for world in opened:
        world.close()


@pytest.mark.parametrize("settings", ["", "closing: end", "put_criterion: release"])
def test_it_ends_as_in_our_own_run(settings, data, tmp_path, task_file, open_world, run_cli):
    task_file(", ".join(filter(None, (SHORT, settings))))
    world = open_world()
    found = {}
    for name in world.units:
        view = world.reset(name)
        while view.ended is None:
            view = world.step(OPENS)
        found[name] = (str(view.ended), view.success, view.reward)
    (tmp_path / "opens.py").write_text(
        "def act(image, instruction):\n    return [0.03, 0, 0.02, 0, 0.1, 0, 1]\n"
    )
    words = option_words(
        model=f"{tmp_path / 'opens.py'}:act", tasks=TASKS, data=data, out=tmp_path / "ours"
    )
    code, _, err = run_cli(*words)
    assert code == 0, err
    ours = {f"{it.task}/{it.id}": it.payload for it in read_records(tmp_path / "ours")}
    assert found == {name: (it.ended, it.done, it.reward) for name, it in ours.items()}


def test_a_world_that_lost_its_simulator_begins_again(task_file, open_world, monkeypatch):
    task_file(SHORT)
    world = open_world("manipulathor_pickup")
    (name,) = world.units
    with pytest.raises(RuntimeError, match="reset the world"):
        world.step(OPENS)
    world.reset(name)

    def lose(self, action):
        raise SimulatorError("the simulator is lost")

    with monkeypatch.context() as patched:
        patched.setattr(ArmEnvironment, "step", lose)
        with pytest.raises(SimulatorError):
            world.step(OPENS)
    with pytest.raises(RuntimeError, match="reset the world"):
        world.step(OPENS)
    assert world.reset(name).images["agentview"].shape == (64, 64, 3)


def test_a_trajectory_that_cannot_be_used_is_named(data):
    (data / "broken.json").write_text("{}")
    with pytest.raises(DataError, match=r"broken.json cannot be used \(.*\); mend it or take"):
        arm_evaluation(TASKS, str(data))


def test_a_task_about_frames_before_it_is_refused(data, monkeypatch):
    monkeypatch.setattr(ManipulationTask, "tells_history", True)
    with pytest.raises(UsageError, match="manipulathor_pickup is about frames before it"):
        arm_evaluation(TASKS, str(data))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"task": "nieh_mini"}, "is no task of an arm"),
        ({"task": "manipulathor_mimi"}, "did you mean 'manipulathor_mini'"),
        ({"task": "manipulathor_mini", "limit": 0}, "limit must be at least 1"),
        ({"task": "manipulathor_mini", "cameras": "back"}, "cameras"),
    ],
)
def test_a_bad_value_is_refused_in_a_line(given, said):
    with pytest.raises(UsageError, match=said):
        arm_evaluation(**given)
