"""Random messages against the localization filters."""
