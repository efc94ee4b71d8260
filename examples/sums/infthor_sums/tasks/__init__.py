"""Task files; there is no code here."""
