"""Talking to AI2-THOR, be it the embedded simulator or Unity."""

__all__: list[str] = []
