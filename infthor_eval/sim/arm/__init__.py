"""The robot arms of agent modes `arm` (ManipulaTHOR) and `stretch`: their geometry, what they touch, what they hold."""
