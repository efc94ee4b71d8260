"""Fine-tuning of models on sequences from trajectories and questions."""
