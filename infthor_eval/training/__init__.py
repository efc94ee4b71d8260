"""Fine-tuning of models on sequences from trajectories and questions.

To add or change what a model is trained on: `action_sequences.py`, `data.py`; of final tasks,
`final_sequences.py`; which tokens have loss, `encoding.py`.
"""
