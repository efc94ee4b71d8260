"""Reading and writing: NIEH sets, trajectories, step logs, frame references."""
