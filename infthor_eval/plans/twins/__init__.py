"""Twins for agents: two worlds of one history, whose final task needs an object elsewhere."""
