"""What several commands share: options, and how their values are written."""
