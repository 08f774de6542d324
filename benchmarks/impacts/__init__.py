"""Impacts, beside the engines of games and robots, and beside a loop of events with no engine around it."""
