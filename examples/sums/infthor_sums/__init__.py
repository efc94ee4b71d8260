"""A suite for infthor-eval: models add two numbers."""
