"""Servers of OpenAI's chat completions: vLLM, SGLang, transformers, commercial."""
