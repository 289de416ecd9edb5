"""The node navsat_transform_node."""
