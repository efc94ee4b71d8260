"""Recorded runs of plans: their curves and their replay."""
