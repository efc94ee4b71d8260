"""Tasks as the published scripts ask for them: a system prompt, and no text of a plan.

Final tasks (`--protocol published`) are run in one go. The expert carries out all tasks but the
last; the agent then has the last one, its plans following each other in the world that it has made.
It is told the goal alone, in one of three forms:

- interleaved (`--history full`): the whole history as a user's turn. After the first plan, done or
  failed, the script ends; the other plans are never tried, and count as not done.
- memory as text (`--history text`) and as frames (`--history retrieved:K`, the frames that the
  trajectory's file names, or `frames:K`, those nearest to the present one): each action is asked
  for anew, with the memory and the present frame. After a failure the next plan follows.

In the chats of branch `dev` every plan begins in the true state, as in the default protocol:
`--history goals` is `run_interactive_eval_qwen.py`, `--history plans`
`run_interactive_eval_history.py`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from infthor_eval.errors import UsageError
from infthor_eval.formats.trajectory import Trajectory
from infthor_eval.household.sequence_text import ACT
from infthor_eval.plans.history.forms import GoalHistory, PlanHistory, StateInWords
from infthor_eval.plans.history.past import ChosenHistory, CountTokens, History, Past
from infthor_eval.plans.history.recalled import RecalledHistory
from infthor_eval.plans.history.retrieved import RetrievedFrames
from infthor_eval.plans.history.segments import Part
from infthor_eval.plans.published.system_prompts import system_prompt
from model_adapters import Decoding

_MAX_TOKENS = 32
MAX_STEPS = 201  # of one plan


@dataclass(frozen=True)
class FinalForm:
    """One of the forms.

    Attributes:
        system: text of the system's turn.
        history: what the agent is given before its first action.
        asks_anew: whether each action is asked for anew; else its actions and frames are added to
            the history.
        goes_on: whether later plans are tried after the first.
        ends: texts that end a reply.
    """

    system: str
    history: History
    asks_anew: bool = False
    goes_on: bool = False
    ends: tuple[str, ...] = ()

    def decoding(self, seed: int) -> Decoding:
        """Return the decoding of Qwen2.5-VL's settings: greedy, with the checkpoint's penalty."""
        return Decoding(max_new_tokens=_MAX_TOKENS, seed=seed, stop=self.ends)


@dataclass(frozen=True)
class _TextMemory(History):
    """The task, and the state of the room in words."""

    needs_state: ClassVar[bool] = True

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `History`."""
        return [_task_text(past) + f"State: You are in the middle of a room. {past.state};\n"]


@dataclass(frozen=True)
class _FrameMemory(History):
    """The task, and frames of what came before."""

    frames: ChosenHistory

    def recall(self, past: Past, count: CountTokens) -> list[Part]:
        """See `History`."""
        return [f"{_task_text(past)}Previous states: ", *self.frames.choose(past, count)]


def final_form(history: History, name: str) -> FinalForm:
    """Return the form of a value of `--history`, given what it stands for elsewhere."""
    if name in ("full", "published"):
        return FinalForm(system_prompt("goals"), GoalHistory(), ends=(ACT,))
    if isinstance(history, StateInWords):
        return FinalForm(system_prompt("text"), _TextMemory(), asks_anew=True, goes_on=True)
    if isinstance(history, RetrievedFrames) or (
        name.startswith("frames:") and isinstance(history, RecalledHistory)
    ):
        memory = _FrameMemory(history)
        return FinalForm(system_prompt("frames"), memory, asks_anew=True, goes_on=True)
    raise UsageError(
        f"--protocol published has the histories full, text, retrieved:K and frames:K, not {name}"
    )


def chat_form(history: History) -> FinalForm | None:
    """Return how a chat asks an agent with this history; None if it continues the bare sequence."""
    if isinstance(history, GoalHistory):
        return FinalForm(system_prompt("goals"), history, ends=(ACT,))
    if isinstance(history, PlanHistory):
        return FinalForm(system_prompt("plans"), history, asks_anew=True)
    return None


def with_recorded_state(past: Past, trajectory: Trajectory, first: int) -> Past:
    """Return a past with the state that the trajectory's file has for an action, if it has one."""
    recorded = (trajectory.state_summary or {}).get(str(first))
    return past if recorded is None else replace(past, state=recorded)


def present_parts(frame: Part) -> Sequence[Part]:
    """Return what stands behind the memory when an action is asked for anew."""
    return ("Current state: ", frame, " Next action: ")


def _task_text(past: Past) -> str:
    return f"Your task is: {past.goal}.\n"
