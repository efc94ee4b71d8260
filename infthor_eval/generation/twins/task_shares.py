"""How often tasks name an object: what is carried in a world must not tell that world apart.

A room's tasks name a mug more often than a statue. So in an edited world in which the agent
carries the statue, the statue would say which of two worlds is the edited one.
"""

import random
from collections import Counter

from infthor_eval.generation.sampling import TaskPool
from infthor_eval.household.possible_tasks import open_tasks, usual_tasks
from infthor_eval.household.symbolic import room_of
from infthor_eval.thor.view import SimulatorView

__all__ = ["task_shares"]

_N_DRAWN = 400


def task_shares(view: SimulatorView, scene: str) -> Counter[str]:
    """Draw tasks as the generator does, and count those that name each type as carried.

    Args:
        view: the state that tasks are drawn in.
        scene: name of the scene.

    Returns:
        Number of tasks, of the same number of draws in every scene, by object type.
    """
    types = {obj.object_type for obj in view.objects.values()}
    tasks = open_tasks(room_of(view), types, usual_tasks(scene))
    rng = random.Random(0)
    shares: Counter[str] = Counter()
    for _ in range(_N_DRAWN):
        task = TaskPool(rng).draw(tasks)
        if task is not None:
            shares.update(name for name in (task.pickup, task.movable) if name)
    return shares
