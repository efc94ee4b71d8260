"""What an agent is given of the true history before it acts."""
