"""Simulated motions as tables and in shards."""
