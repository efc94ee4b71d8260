"""transformers, imported without scikit-learn and scipy's optimizers, which take a fifth of the time until a model can
be asked.

Its generation imports one curve of scikit-learn's wherever that is installed (lm-eval needs it), for a threshold of
assisted generation, and its losses one assignment of scipy's, for the detection of objects; no adapter uses either.
"""

import importlib
import sys

import transformers.utils

__all__: list[str] = []

# What imports it, how transformers asks whether it is there, and what it would import.
_NEEDLESS = (
    ("transformers.loss.loss_utils", "is_scipy_available", "scipy.optimize"),
    ("transformers.generation.candidate_generator", "is_sklearn_available", "sklearn"),
)


def _import_without(module: str, question: str, needless: str) -> None:
    available = getattr(transformers.utils, question)
    setattr(transformers.utils, question, lambda: needless in sys.modules)
    try:
        importlib.import_module(module)
    finally:
        setattr(transformers.utils, question, available)


for _needless in _NEEDLESS:
    _import_without(*_needless)
