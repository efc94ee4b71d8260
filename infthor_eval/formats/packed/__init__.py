"""Sets in Parquet: a table each of questions, frames, steps, trajectories, files and twins."""
