"""What the page opens with: a sentence, a chart and a table of runs, made from their numbers.

The words of a suite's sentence are its presenter's (`PlainPresenter.finding_of`).
"""
