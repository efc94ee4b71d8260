"""Servers of Google's Gemini API."""
