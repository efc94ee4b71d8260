"""From the turns of a conversation to what a language model reads."""
