"""Models that vLLM runs in this process; `engine` is the one module that imports it."""
