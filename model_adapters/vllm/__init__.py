"""Models that vLLM runs in this process; only `engine` imports vLLM."""
