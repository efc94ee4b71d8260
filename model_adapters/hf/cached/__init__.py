"""A model behind a KV cache: encoded prefixes, several continuations, replies token by token."""
