"""Replies scored again: by today's scorers, one's own, or a judge.

To add or change what a judge does: which replies it is asked about, `unsure.py`; its prompt, and
how its verdict is read, `judge_prompts.py`; what follows from it, `judging.py`.
"""
