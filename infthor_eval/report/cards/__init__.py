"""What is said of a set when it is published: a data set card and a Croissant file."""
