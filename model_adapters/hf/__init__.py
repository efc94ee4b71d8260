"""transformers in this process: one KV-cached conversation for every model family."""

import model_adapters.lean_transformers  # noqa: F401 - before any module imports transformers
