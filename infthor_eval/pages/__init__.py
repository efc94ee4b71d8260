"""Local pages, in one file or served by a running command; what is on them is another package's."""
