"""What is wrong with a robot's folder of numbers."""
