"""Tiny twins of model families: the real classes, random weights, for tests and trials."""

import model_adapters.lean_transformers  # noqa: F401 - before any module imports transformers
