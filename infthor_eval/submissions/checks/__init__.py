"""The checks of a submission, a class each behind one protocol.

To add or change a check of submissions: a class here with the members of
`infthor_eval/submissions/case.py: Check`, its name in `infthor_eval/submissions/checking.py:
CHECKS`, and a forged submission in `tests/submissions/forged_answers.py` or
`tests/submissions/forged_runs.py`.
"""
