import re

import pytest

from infthor_eval.household.pddl import DOMAIN, problem
from infthor_eval.household.planner import plan
from infthor_eval.household.possible_tasks import tasks_of
from infthor_eval.household.symbolic import room_of
from infthor_eval.household.tasks import TaskType

from .rooms import KITCHEN

ROOM = room_of(KITCHEN)
TASKS = tasks_of(ROOM, {"Faucet"})


def read(text):
    """PDDL as nested lists."""
    text = re.sub(r";.*", "", text)
    stack = [[]]
    for token in re.findall(r"[()]|[^\s()]+", text):
        if token == "(":
            stack.append([])
        elif token == ")":
            done = stack.pop()
            stack[-1].append(done)
        else:
            stack[-1].append(token)
    assert len(stack) == 1 and len(stack[0]) == 1
    return stack[0][0]


def declared(domain):
    predicates = next(section for section in domain if section[0] == ":predicates")
    return {item[0] for item in predicates[1:]}


def test_the_domain_is_well_formed():
    domain = read(DOMAIN)
    actions = [section for section in domain if section[0] == ":action"]
    assert len(actions) == 11 + len(TaskType)
    for action in actions:
        parameters = {word for word in action[3] if word.startswith("?")}
        used = set(re.findall(r"\?\w+", str(action[4:])))
        assert used <= parameters
        names = set(re.findall(r"\['([a-z_-]+)'", str(action[4:])))
        assert names - {"and", "not", "increase", "total-cost"} <= declared(domain)


@pytest.mark.parametrize("task", TASKS[::7], ids=str)
def test_problems_use_what_the_domain_declares(task):
    text = read(problem(task, ROOM))
    init = next(section for section in text if section[0] == ":init")
    objects = set(next(section for section in text if section[0] == ":objects")[1:])
    objects -= {"-", "item", "place"}
    for fact in init[2:]:
        assert fact[0] in declared(read(DOMAIN))
        assert set(fact[1:]) <= objects
    assert plan(task, ROOM) is not None
