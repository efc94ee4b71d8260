"""Runs in folders: finding, naming and repeating them."""
