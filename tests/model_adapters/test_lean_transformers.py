"""What is not imported where a model is loaded."""

import subprocess
import sys


def test_a_model_is_loaded_without_scikit_learn_and_scipys_optimizers():
    code = (
        "import sys, model_adapters.hf.families.qwen2_5_vl; print(*({'sklearn', 'scipy.optimize'} "
        "& set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "\n"
