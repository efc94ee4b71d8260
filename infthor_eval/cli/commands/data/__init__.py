"""Commands that make data: trajectories, frames, questions, twins, and what is said of sets."""
