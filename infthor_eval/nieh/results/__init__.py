"""What NIEH runs amount to: the summary of a journal, and its tables."""
