"""A planner of arms: `steps.plan_steps` finds collision-free paths to pick up and to put."""
