"""Runs as one page that works offline: their results, and every sample with its frames and
replies."""
