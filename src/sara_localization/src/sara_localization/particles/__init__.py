"""amcl without ROS: adaptive Monte Carlo localization in a known map."""
