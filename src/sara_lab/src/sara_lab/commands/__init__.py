"""The command line of the laboratory where it needs both lockstep and ROS."""
