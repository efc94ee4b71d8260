"""Talking to AI2-THOR, either the embedded simulator or Unity."""

__all__: list[str] = []
