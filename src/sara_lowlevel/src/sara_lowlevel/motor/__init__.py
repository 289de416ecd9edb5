"""The motor node: wheel commands in, an AX3500 driven, encoder frames out."""
