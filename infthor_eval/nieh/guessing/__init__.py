"""What can be guessed without a frame: guessers, the audit of a set, and a subset in which guessing
does not help."""
