"""Maps by range sensors with wide cones: walls as lines hold the way, and the grid is drawn of them."""
