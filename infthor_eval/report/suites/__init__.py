"""Presenters of the suites of this package."""
