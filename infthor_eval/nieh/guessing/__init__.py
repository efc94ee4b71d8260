"""Guessing without a frame: guessers, the audit of a set, a subset where guessing does not help."""
