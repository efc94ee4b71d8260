"""A person as a model: a local page shows what a model would be given, and takes the reply."""
