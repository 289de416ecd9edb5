"""Drives that are judged: journeys between random poses, squares and doors."""
