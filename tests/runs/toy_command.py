"""The toy suite as a command: OUTPUT [SECONDS PER UNIT]."""

import sys
import time
from pathlib import Path

from infthor_eval.runs import RunRequest, TaskFile, TaskRequest
from tests.runs.toy import Sums, ToySuite


def request(output, **changes):
    task = TaskFile("sums", "toy", Path("sums.yaml"), {"task": "sums", "metadata": {"version": 1}})
    fields = {"model": "adder", "tasks": TaskRequest([task], None), "asked": ("sums",), "output": output}
    return RunRequest(**{**fields, **changes})


class SlowSuite(ToySuite):
    def prepare(self, request):
        return Slow()


class Slow(Sums):
    def run(self, group, session):
        for record in super().run(group, session):
            time.sleep(float(sys.argv[2]))
            yield record


if __name__ == "__main__":
    from infthor_eval.cli.commands.run import evaluate
    from infthor_eval.cli.showing import Showing

    sys.exit(evaluate([(request(Path(sys.argv[1])), SlowSuite() if len(sys.argv) > 2 else ToySuite())], Showing()))
