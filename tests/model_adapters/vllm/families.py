"""The families that are compared in vLLM and transformers, and what is compared."""

from typing import Any

from model_adapters import Reply

__all__ = ["FAMILIES", "TEXTS", "adapter_of", "facts"]

FAMILIES = ("qwen2.5-vl", "llava-onevision", "pixtral", "llava", "idefics3")

TEXTS = ("What do you see?", "RotateLeft. OpenObject Fridge. " * 20 + "\nWhat is open?")


def adapter_of(family: str) -> str:
    """Who loads a family; the last two are nobody's own."""
    return family if family in FAMILIES[:3] else "hf-vlm"


def facts(reply: Reply) -> tuple[Any, ...]:
    """What is equal in equal replies."""
    return reply.text, reply.token_ids, reply.n_reply_tokens, reply.n_context_tokens
