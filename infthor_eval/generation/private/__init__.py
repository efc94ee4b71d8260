"""Sets from a secret: the whole is the key, and a part can be published."""
