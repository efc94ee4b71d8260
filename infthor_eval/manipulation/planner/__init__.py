"""A planner of arms: `reaching.plan_steps` finds collision-free paths to pick up and to put."""
