from infthor_eval.household.tasks import Task, TaskType, sub_task


def test_descriptions():
    def words(task):
        return sub_task(task, "kitchen-1").task_desc

    assert words(Task(TaskType.PLACE, "Apple", "Fridge", sliced=True)) == "put a sliced apple in the fridge"
    assert words(Task(TaskType.PLACE_TWO, "Knife", "CounterTop")) == "put two knives on the counter top"
    assert words(Task(TaskType.PLACE_TWO, "Apple", "Fridge", sliced=True)) == "put two slices of apple in the fridge"
    assert words(Task(TaskType.EXAMINE, "Mug", light="DeskLamp")) == "look at a mug under the desk lamp"
    stack = Task(TaskType.STACK, "Apple", "CounterTop", movable="Plate")
    assert words(stack) == "put a plate with an apple on it on the counter top"
