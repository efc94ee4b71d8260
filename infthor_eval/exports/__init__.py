"""Runs in the formats of others, a module or two for each format, and their back way.

What comes back is read by `infthor_eval/formats/replies/logs.py`.
"""

__all__ = ["LM_EVAL_MODEL"]

LM_EVAL_MODEL = "infthor"  # name of our model class in lm-eval, and of our runs in its files
