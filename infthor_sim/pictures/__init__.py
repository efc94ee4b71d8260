"""What cameras see: views, colours of instances, visibility."""
