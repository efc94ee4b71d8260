"""What keeps lm-eval below 0.5, told apart: a fault of theirs and one of ours.

Each test fails when its fault is gone; with both gone the upper limit in pyproject.toml can rise.
"""

from importlib.metadata import version

import pytest

from infthor_eval.storage.folders import packaged_folder
from tests.harness.conftest import LM_EVAL, OURS_WITH_ALL_TASKS

pytestmark = pytest.mark.skipif(
    version("lm_eval").startswith("0.4."), reason="of lm-eval 0.5: make test-lm-eval"
)
ASKED = ("run", "--model", "infthor", "--model_args", "adapter=qwen2.5-vl-tiny", "--limit", 2)


def test_ours_its_script_looks_for_the_model_before_a_task_file_registers_it(start):
    file = packaged_folder("tasks") / "nieh" / "nieh_mini_gt.yaml"
    with pytest.raises(AssertionError, match=r"infthor.*no model for this name"):
        start(LM_EVAL, *ASKED, "--tasks", file)


def test_theirs_tasks_with_images_are_refused_and_we_say_what_to_install(start):
    with pytest.raises(AssertionError, match=r"pip install 'lm_eval>=0\.4\.13,<0\.5'") as refused:
        start(OURS_WITH_ALL_TASKS, "lm-eval", *ASKED, "--tasks", "nieh_mini_gt")
    assert "no model for this name" not in str(refused.value)
