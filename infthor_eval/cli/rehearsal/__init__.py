"""`doctor --rehearse`: what a model needs on a GPU for some tasks, told without one."""
