"""Tiny checkpoints of the families that `families.py` tries, and the trial of one."""
