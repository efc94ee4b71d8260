"""NIEH: contexts, prompts, scorers, metrics, and the tasks that lm-eval runs."""

from infthor_eval.nieh.scoring import SCORERS, score

__all__ = ["SCORERS", "score"]
