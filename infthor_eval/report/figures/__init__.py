"""Figures of the paper from the journals of runs.

To add a figure: its numbers in the suite's package, its drawing here, its name in the suite's
presenter, its section in `docs/figures.md`.
"""
