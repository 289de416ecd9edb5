"""How well a drive was driven, in figures: errors, comfort, gaps to obstacles, contacts."""
