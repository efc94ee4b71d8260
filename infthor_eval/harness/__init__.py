"""All that touches lm-eval: our tasks and models as its guests, and our runs in its files."""
