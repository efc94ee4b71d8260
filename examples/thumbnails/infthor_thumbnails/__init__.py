"""A model for infthor-eval that looks at thumbnails, and a task for it."""
