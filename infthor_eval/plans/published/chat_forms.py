"""Plans one by one as the published chat scripts ask for them: a system prompt, and no text of the
plan.

`--history goals` is `run_interactive_eval_qwen.py`, `--history plans`
`run_interactive_eval_history.py`, both of branch `dev`. As in the default protocol, every plan
begins in the true state.
"""

from infthor_eval.household.sequence_text import ACT
from infthor_eval.plans.history.chat import GoalHistory, PlanHistory
from infthor_eval.plans.history.past import History
from infthor_eval.plans.published.final_protocol import FinalForm
from infthor_eval.plans.published.system_prompts import system_prompt

__all__ = ["chat_form"]


def chat_form(history: History) -> FinalForm | None:
    """Return how an agent with this history is asked in a chat; None if it continues the bare
    sequence."""
    if isinstance(history, GoalHistory):
        return FinalForm(system_prompt("goals"), history, ends=(ACT,))
    if isinstance(history, PlanHistory):
        return FinalForm(system_prompt("plans"), history, asks_anew=True)
    return None
