"""Fine-tuning of models on sequences from trajectories and questions.

To add or change what a model is trained on: `action_sequences.py`, `question_sequences.py`; of
final tasks, `goal_sequences.py`, `memory_sequences.py`; which tokens have loss, `encoding.py`.
"""
