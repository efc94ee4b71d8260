"""What is solid, what is free, what falls and slides: rules on the boxes and parts of objects."""
