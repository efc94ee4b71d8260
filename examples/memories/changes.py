"""A memory to copy: frames at which the view changed most, by the mean colour of each."""

import numpy as np

from infthor_eval.memory import MemoryCapabilities


class Changes:
    """The frames after the largest changes of the view's mean colour."""

    capabilities = MemoryCapabilities()

    def __init__(self, k: int = 10):  # --memory-args k=5
        self.k = k

    def identity(self):
        return {}  # what can change a recall beside this file and its options

    def begin(self, facts):
        self.size = facts.tokens_per_frame
        self.steps, self.changes, self.before = [], [], None

    def observe(self, step):
        colour = np.asarray(step.frame.load()).mean(axis=(0, 1))
        self.changes.append(0.0 if self.before is None else float(abs(colour - self.before).sum()))
        self.steps.append(step)
        self.before = colour

    def recall(self, query, budget):
        room = self.k if budget is None or self.size is None else budget // self.size
        order = sorted(range(len(self.steps)), key=lambda place: -self.changes[place])
        return [self.steps[place] for place in sorted(order[:room])]
