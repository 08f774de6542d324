"""When two shapes will touch: one file a pair of shapes, each plain arithmetic on floats and tuples.

Touching and approaching is an impact. Touching means a gap of at most ``touch`` [m], normally 1e-12 of
the sizes; approaching means a speed of less than ``-still`` [m/s], normally 1e-14 of the speeds at hand.
"""
