"""Local pages that a running command serves; what is on them is another package's."""
