"""The thesis's experiments E1 to E10 (its chapter 4), each a module or a function of one; `registry.EXPERIMENTS` has
them by name.
"""
