"""Which devices of a network are let in: codes shown on the chair, and tokens."""
