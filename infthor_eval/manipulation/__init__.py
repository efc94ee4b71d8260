"""Pick-up and put with an arm: policies in single actions of long trajectories."""
