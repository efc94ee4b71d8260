"""System prompts of the published scripts and trainers of branch `dev` (`prompts.yaml`)."""

from functools import cache
from pathlib import Path
from typing import Literal

from infthor_eval.formats.yaml_files import read_yaml

# The whole history without plans, a memory in words, one of frames, the plans before.
PromptForm = Literal["goals", "text", "frames", "plans"]
_FILE = Path(__file__).with_name("prompts.yaml")


@cache
def system_prompt(form: PromptForm) -> str:
    """Return the text of the system's turn."""
    prompts = read_yaml(_FILE, "install the package again")
    if form == "goals":
        return str(prompts["interleaved"])
    if form == "plans":
        return str(prompts["plans"])
    return str(prompts["memory"].format(given=prompts[f"given_{form}"]))
