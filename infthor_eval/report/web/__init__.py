"""Runs as one page that works from a file: what was found, and every sample with what was seen and said."""
