"""The ROS shells of sara_localization: the node, the offline filter, the conversions."""
