"""The checks of a submission, a function each.

To add or change a check of submissions: a function here with the decorator
`infthor_board/case.py: check`, its name in `infthor_board/checking.py: CHECKS`, and a forged
submission in `tests/infthor_board/forged_answers.py` or `tests/infthor_board/forged_runs.py`.
"""
