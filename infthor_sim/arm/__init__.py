"""Arms of the modes `arm` (ManipulaTHOR) and `stretch`: geometry, collisions, held objects."""
