"""Failures of specimens as statistics: scatter laws, exposures along simulated histories, likelihoods with suspensions,
intervals.
"""
