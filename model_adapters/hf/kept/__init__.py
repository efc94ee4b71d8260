"""Memories in the model's cache: keys and values of a trajectory, cut to a budget of tokens."""
