"""A page of checked submissions, in one file."""
