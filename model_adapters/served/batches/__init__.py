"""Requests in batches: collected, submitted once, waited for, fetched, in whatever dialect."""
