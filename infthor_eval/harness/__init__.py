"""Everything that uses lm-eval: our tasks and models under its command, our runs in its files."""
