"""From a scene to who serves what: groups, steppers, servers of conditions; and the scene at work."""
