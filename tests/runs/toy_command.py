"""The toy suite as a command: OUTPUT [GATE]; unit N waits until the folder GATE holds the file
open-N."""

import itertools
import sys
import time
from pathlib import Path

from infthor_eval.runs import RunRequest, TaskFile, TaskRequest
from tests.helpers.toy_suite import Sums, ToySuite, make_suite


def request(output, **changes):
    task = TaskFile("sums", "toy", Path("sums.yaml"), {"task": "sums", "metadata": {"version": 1}})
    fields = {
        "model": "adder",
        "tasks": TaskRequest([task], None),
        "task_names": ("sums",),
        "output": output,
    }
    return RunRequest(**{**fields, **changes})


class Gated(Sums):
    numbers = itertools.count()

    def run(self, group, session):
        gate = Path(sys.argv[2])
        for record in super().run(group, session):
            number = next(self.numbers)
            (gate / f"waiting-{number}").touch()
            while not (gate / f"open-{number}").exists():
                time.sleep(0.01)
            yield record


if __name__ == "__main__":
    from infthor_eval.cli.commands.run import evaluate
    from infthor_eval.cli.options.show import ShowOptions

    suite = make_suite(Gated) if len(sys.argv) > 2 else ToySuite()
    sys.exit(evaluate([(request(Path(sys.argv[1])), suite)], ShowOptions()))
