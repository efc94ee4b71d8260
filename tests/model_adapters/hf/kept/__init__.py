"""Memories in the cache."""
