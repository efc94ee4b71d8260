"""One module per model family: its tokens per frame, features and positions."""
