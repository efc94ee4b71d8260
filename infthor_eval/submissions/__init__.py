"""Submissions of others: read, checked before they are believed, and put into rows."""
