"""Tiny twins of the model families: the real classes with random weights, for tests and demonstrations."""
