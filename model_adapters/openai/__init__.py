"""Models behind a server of OpenAI's chat completions: vLLM, SGLang, transformers, commercial."""
