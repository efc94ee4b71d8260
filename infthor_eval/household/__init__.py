"""Household tasks: goals, affordances, symbolic states, plans, places to act from, and texts."""
