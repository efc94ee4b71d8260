"""Pairs of questions for lmms-eval: task files for its `--include_path`, and their functions."""

from pathlib import Path

PATH = Path(__file__).parent
"""Folder of the task files."""
