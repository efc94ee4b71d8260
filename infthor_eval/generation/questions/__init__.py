"""Rules that generate NIEH questions from the step log of a replayed trajectory.

To add a question type: a rule here, in `generate.py: further_candidates_of`; how it is checked, in
`solvers.py`; its words in `infthor_eval/formats/question_forms.py`; its row in `docs/questions.md`.
"""
