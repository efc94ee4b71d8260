"""Cross-validation of questions (paper, A.1.3), and the files of a validated set."""
