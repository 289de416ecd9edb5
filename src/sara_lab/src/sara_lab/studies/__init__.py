"""Studies of the filters: consistency (NEES), and the inputs of the thesis."""
