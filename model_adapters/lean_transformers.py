"""Import transformers without scikit-learn and scipy's optimizers: a fifth of the start-up time.

transformers imports one function of scikit-learn wherever that is installed (lm-eval needs it), for
assisted generation, and one of scipy, for the losses of object detection. No adapter uses either.
"""

import importlib
import sys

import transformers.utils

__all__: list[str] = []

# The importing module, transformers' test for the package, and the package.
_UNUSED = (
    ("transformers.loss.loss_utils", "is_scipy_available", "scipy.optimize"),
    ("transformers.generation.candidate_generator", "is_sklearn_available", "sklearn"),
)


def _import_without(module: str, test_name: str, package: str) -> None:
    """Import a module of transformers, which takes a package not yet imported for missing."""
    is_available = getattr(transformers.utils, test_name)
    setattr(transformers.utils, test_name, lambda: package in sys.modules)
    try:
        importlib.import_module(module)
    finally:
        setattr(transformers.utils, test_name, is_available)


for _unused in _UNUSED:
    _import_without(*_unused)
