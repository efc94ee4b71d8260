"""The journal of a run: its lines, its shards, and who reads it while it is written."""
