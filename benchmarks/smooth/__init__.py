"""Smooth motion beside its peers: run time against error, with references of more digits than float64 has."""
