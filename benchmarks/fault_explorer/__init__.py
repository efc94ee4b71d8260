"""Runs of each kind, cut at each of their calls that change files."""
