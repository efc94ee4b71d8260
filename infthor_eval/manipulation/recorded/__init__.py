"""Recorded runs of arms: their curves and their replay."""
