"""Everything that uses lm-eval: our tasks and models under its command, and our runs in its
files."""
