"""Wakeup conditions at work: who is armed with what, who finds its events, and how they reach the containers."""
