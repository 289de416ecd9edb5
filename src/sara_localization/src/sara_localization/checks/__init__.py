"""What is wrong with a filter's configuration, by itself and against a recorded drive."""
