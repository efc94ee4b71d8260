"""What suites that act in a simulator share: trajectories, simulators, retries, records and
curves."""
