"""The page on a run as it goes."""
