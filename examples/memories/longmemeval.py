"""Runs a memory that was written for LongMemEval-V2: `insert(trajectory)`, then `query(text,
image)`.

    infthor-eval --memory ./longmemeval.py:LongMemEval --memory-args
    memory=my_package:MyMemory,params=my.json ...

Their states have the action that is taken next, ours the one before. They insert whole
trajectories: ours is inserted at the first question, and anew when an agent has gone on.
"""

import json
from importlib import import_module
from pathlib import Path

from infthor_eval.memory import MemoryCapabilities, tokens_of


class LongMemEval:
    """A memory of LongMemEval-V2."""

    capabilities = MemoryCapabilities(deterministic=False)  # what it does is not known here

    def __init__(self, memory: str = "longmemeval:Nothing", params: str = ""):
        module, _, name = memory.partition(":")
        self.kind = Nothing if name == "Nothing" else getattr(import_module(module), name)
        self.params = json.loads(Path(params).read_text()) if params else {}

    def identity(self):
        return {"params": self.params}

    def begin(self, facts):
        self.facts, self.steps, self.memory = facts, [], None

    def observe(self, step):
        self.steps.append(step)
        self.memory = None

    def recall(self, query, budget):
        if not self.steps:
            return []
        if self.memory is None:
            self.memory = self.kind(self.params)
            self.memory.insert(self.trajectory())
        by_path = {str(step.frame.path): step for step in self.steps}
        recalled = []
        for item in self.memory.query(query.text, query_image=str(query.present.frame.path)):
            recalled.append(item["value"] if item["type"] == "text" else by_path[item["value"]])
            if (
                budget is not None
                and tokens_of(recalled, self.facts.tokens_per_frame or 0) > budget
            ):
                return recalled[:-1]  # their harness cuts off what is beyond the budget, too
        return recalled

    def trajectory(self):
        actions = [step.action for step in self.steps[1:]] + [None]
        states = [
            {
                "state_index": number,
                "step": number,
                "url": f"infthor://{self.facts.name}/{step.number}",
                "action": action,
                "accessibility_tree": "",
                "screenshot": str(step.frame.path),
            }
            for number, (step, action) in enumerate(zip(self.steps, actions, strict=True))
        ]
        goal = next((step.goal for step in reversed(self.steps) if step.goal), "")
        return {
            "id": self.facts.name,
            "goal": goal,
            "outcome": None,
            "start_url": states[0]["url"],
            "states": states,
        }


class Nothing:
    """Recalls nothing: the current view alone."""

    def __init__(self, params):
        pass

    def insert(self, trajectory):
        pass

    def query(self, query, query_image=None):
        return []
