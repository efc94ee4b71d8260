"""Replies scored again: by today's scorers, one's own, or a judge."""
