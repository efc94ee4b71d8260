"""What the page opens with: a sentence, a chart and a table of runs, made from their numbers.

To change the words of a suite's sentence: `finding` of its presenter.
"""
