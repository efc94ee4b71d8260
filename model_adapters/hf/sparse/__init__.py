"""Sparse attention: which earlier tokens each token sees, computed for those alone."""
