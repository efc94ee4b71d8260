"""Fine-tuning: sequences with labels from trajectories and questions, and models that are trained on them."""
