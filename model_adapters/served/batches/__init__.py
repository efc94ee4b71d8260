"""Requests in batches: gathered, submitted once, waited for, fetched, in whatever dialect."""
