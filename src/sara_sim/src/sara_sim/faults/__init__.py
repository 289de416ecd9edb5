"""Everything that can be made to go wrong with the chair."""
