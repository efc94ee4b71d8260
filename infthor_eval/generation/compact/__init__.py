"""Storing sets in few bytes, for the package."""
