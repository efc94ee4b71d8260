"""Progress of long work, and notes on it, on standard error."""
