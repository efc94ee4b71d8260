"""Household tasks: goals, affordances, symbolic states, plans, places to act from, and texts."""

__all__: list[str] = []
