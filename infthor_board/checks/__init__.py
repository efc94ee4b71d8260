"""The checks of a submission, a class each behind one protocol.

To add or change a check of submissions: a class here with the members of `infthor_board/case.py:
Check`, its name in `infthor_board/checking.py: CHECKS`, and a forged submission in
`tests/infthor_board/forged_answers.py` or `tests/infthor_board/forged_runs.py`.
"""
