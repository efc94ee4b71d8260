"""Twins for arms: what was brought from where, and first, tells which of two things to pick up."""
