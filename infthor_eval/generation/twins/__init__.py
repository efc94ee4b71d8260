"""Twins: the same episode in two worlds that differ in one thing, so that answers differ."""
