"""What suites that act in a simulator share: trajectories, simulators, records and curves."""
