"""The node slam_gmapping, and its calculation over bags."""
