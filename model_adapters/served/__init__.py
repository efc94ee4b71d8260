"""Models behind a server, in the dialects of OpenAI, Anthropic and Google, one by one or in
batches."""
