"""transformers in this process: one KV-cached conversation for every model family."""
