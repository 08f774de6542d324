"""Sums over all pairs of many bodies, directly and by a tree, beside REBOUND's."""
