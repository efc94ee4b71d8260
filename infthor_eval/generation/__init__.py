"""Generating data: trajectories, their replay to frames and logs, and questions on them."""
