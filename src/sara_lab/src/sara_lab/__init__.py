"""The laboratory: experiments, the judge of drives, campaigns, benches, fuzz tests and studies. No other package
imports it.
"""
