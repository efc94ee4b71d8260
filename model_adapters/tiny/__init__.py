"""Tiny twins of the model families: the real classes with random weights, for tests and for trying
the harness."""

import model_adapters.lean_transformers  # noqa: F401 - before any module imports transformers
