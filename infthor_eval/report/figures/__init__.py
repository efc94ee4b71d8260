"""Figures of the paper from the journals of runs."""
