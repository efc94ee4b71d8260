"""What the doors of other harnesses are compared with: episodes as our own command runs them."""

from collections.abc import Callable
from pathlib import Path

from infthor_eval.episodes.records import InfeasibleError
from infthor_eval.errors import SimulatorError
from infthor_eval.manipulation.environment import ArmEnvironment
from tests.helpers.command_line import option_words
from tests.helpers.journals import read_records
from tests.helpers.trajectories import FORK, MUG, cut_trajectory, write_trajectories

TASKS = "manipulathor_pickup,manipulathor_put"
MAX_STEPS = 6

# Closes its hand on the way in pick-ups; in puts it opens it when the picture says so.
SCRIPT = """
import numpy as np

def act(image, instruction):
    opens = instruction.startswith("put") and np.asarray(image).sum() % 3 == 0
    return [0.04, -0.01, 0.02, 0.0, 0.1, -0.05, float(opens)]
"""


def write_short_tasks(folder: Path, kinds: tuple[str, ...] = ("pickup", "put")) -> None:
    """Makes the tasks' episodes short and their frames small."""
    for kind in kinds:
        (folder / "manipulation" / f"manipulathor_{kind}.yaml").write_text(
            f"include: _manipulation.yaml\ntask: manipulathor_{kind}\n"
            f"dataset_kwargs: {{kind: {kind}, max_steps: {MAX_STEPS}, image_size: 64}}\n"
        )


def write_data(folder: Path) -> Path:
    """Two trajectories."""
    return write_trajectories(folder / "data", cut_trajectory(MUG, 8), cut_trajectory(FORK, 8))


def own_successes(run_cli: Callable[..., tuple[int, str, str]], **options: object) -> dict:
    """Whether each episode succeeds through our own command, by its name."""
    code, _, err = run_cli(*option_words(**options))
    assert code == 0, err
    records = read_records(Path(str(options["out"])))
    return {f"{it.task}/{it.id}": it.payload.done for it in records}


def lose_two_episodes(monkeypatch):
    """Have the first episode not begin, and the second one lose its simulator."""
    begun = []
    reset, step = ArmEnvironment.reset, ArmEnvironment.step

    def reset_but_first(self, *given):
        begun.append(given)
        if len(begun) == 1:
            raise InfeasibleError("the mug cannot be brought to where it was")
        return reset(self, *given)

    def step_but_second(self, action):
        if len(begun) == 2:
            raise SimulatorError("the simulator is lost")
        return step(self, action)

    monkeypatch.setattr(ArmEnvironment, "reset", reset_but_first)
    monkeypatch.setattr(ArmEnvironment, "step", step_but_second)
