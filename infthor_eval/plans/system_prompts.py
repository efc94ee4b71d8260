"""What agents are told by the published scripts and trainers of branch `dev`, word for word (`prompts.yaml`)."""

from functools import cache
from pathlib import Path
from typing import Literal

from infthor_eval.formats.yaml_files import read_yaml

__all__ = ["PromptForm", "system_prompt"]

PromptForm = Literal["goals", "text", "frames"]  # the whole history, a memory in words, a memory of frames
_FILE = Path(__file__).with_name("prompts.yaml")


@cache
def system_prompt(form: PromptForm) -> str:
    """Return the text of the system's turn."""
    prompts = read_yaml(_FILE, "install the package again")
    if form == "goals":
        return str(prompts["interleaved"])
    return str(prompts["memory"].format(given=prompts[f"given_{form}"]))
