"""Containers that find contacts."""
