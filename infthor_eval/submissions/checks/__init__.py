"""The checks of a submission, a class each behind one protocol.

To add or change a check of submissions: a class with the members of `case.py: Check` in a module of
`infthor_eval/submissions/checks/`, its name in `checking.py: CHECKS`, and a forged submission in
`tests/submissions/forged_answers.py` or `tests/submissions/forged_runs.py`.
"""
