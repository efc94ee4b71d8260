"""The first run on a GPU in steps: `gpu_first_run.py` runs them."""
