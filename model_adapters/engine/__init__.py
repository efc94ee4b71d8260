"""The transformers back end: one KV-cached conversation for every model family."""
