"""Runs as one page that works offline: results, and every sample with its frames and replies."""
