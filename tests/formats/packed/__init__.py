"""Sets in Parquet."""
