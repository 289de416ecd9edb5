"""The ROS shells of canserial: one module per node, and conversions."""
