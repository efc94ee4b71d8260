"""Replies to questions that others made: the forms of their logs, and a reply as all have it."""
