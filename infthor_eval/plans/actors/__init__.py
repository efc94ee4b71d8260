"""Who carries plans out: models, people and baselines."""
