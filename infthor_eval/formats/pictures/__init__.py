"""Pictures, films and views in files."""
