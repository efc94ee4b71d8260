"""What a model needs on a GPU, found without one: its code run on shapes."""
