"""Doing a run's work: the driver, who evaluates the groups, in which order."""
