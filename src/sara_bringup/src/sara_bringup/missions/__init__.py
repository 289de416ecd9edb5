"""Missions, named places, patrols and keyboard driving, and the record of a drive."""
