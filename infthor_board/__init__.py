"""Submissions of results, checked; a page of those that pass; sets whose answers stay secret."""
