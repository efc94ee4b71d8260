"""Servers of Anthropic's messages."""
