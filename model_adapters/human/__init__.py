"""A person as a model: what a model would be given is shown on a local page, and the person's
answer is the reply."""
