"""`make bench`: how fast SARA is, every part by name, beside the C++ peers and beside what was measured before
(docs/bench.md).
"""
