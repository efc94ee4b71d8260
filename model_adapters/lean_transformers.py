"""transformers, imported without scikit-learn, which takes a fifth of the time until a model can be asked.

Its generation imports one curve of scikit-learn's wherever that is installed (lm-eval needs it), for a threshold of
assisted generation, which no adapter uses.
"""

import importlib
import sys

import transformers.utils

__all__: list[str] = []


def _import_generation() -> None:
    available = transformers.utils.is_sklearn_available
    transformers.utils.is_sklearn_available = lambda: "sklearn" in sys.modules
    try:
        importlib.import_module("transformers.generation.candidate_generator")
    finally:
        transformers.utils.is_sklearn_available = available


_import_generation()
