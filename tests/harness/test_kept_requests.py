"""`--cache_requests`: lm-eval keeps requests by the name of the task, which says nothing of its
set."""

import json
import subprocess
import sys

import lm_eval.api.task
import pytest

from infthor_eval.errors import UsageError
from infthor_eval.harness import registration
from tests.harness.conftest import OURS


def test_kept_requests_are_refused_with_a_reason():
    registration.register()
    assert lm_eval.api.task.load_from_cache(file_name="requests-nieh_gt", cache=False) is None
    with pytest.raises(UsageError, match="--cache_requests: lm-eval keeps requests by the name"):
        lm_eval.api.task.load_from_cache(file_name="requests-nieh_gt", cache=True)


def test_our_command_says_so_in_one_line(make_nieh_set):
    data = json.dumps({"data": str(make_nieh_set(size=56))})
    words = ("lm-eval", "run", "--model", "infthor", "--model_args", "adapter=qwen2.5-vl-tiny")
    more = ("--tasks", "nieh_gt", "--metadata", data, "--cache_requests", "true")
    command = [sys.executable, "-c", OURS, *words, *more]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr[-3000:]
    assert "Traceback" not in done.stderr
    last = done.stderr.splitlines()[-1]
    assert last.startswith("infthor-eval: --cache_requests: lm-eval keeps")
