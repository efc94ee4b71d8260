"""The robot arms of agent modes `arm` (ManipulaTHOR) and `stretch`: geometry, collisions, and what
they hold."""
