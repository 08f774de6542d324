"""Where a compiled response finds what touches, and where it leaves its answer: places in the contact scratch and in the whole numbers.

``f[0]`` is the scratch, `SCRATCH` floats; ``f[1]`` the parameters of all laws; ``n[0]`` whole numbers. A body begins at `BODY_A` or
`BODY_B`, and what it has is counted from there. All in SI units, vectors in the world frame.
"""

SCRATCH = 128

# Of the contact
NORMAL = 0  # unit vector from a to b
POINT = 3
APPROACH = 6  # above 0: closing
SEPARATION = 7
TIME = 8
TIME_OFFSET = 9  # with the time: the exact instant

# Of each body
BODY_A = 16
BODY_B = 64
POSITION = 0
VELOCITY = 3
SPIN = 6
ORIENTATION = 9
MASS = 13
INVERSE_MASS = 14  # 0: no impulse moves it
INERTIA = 15
RADIUS = 18  # not a number: its shape has none
COLUMNS = 24
MOST_COLUMNS = 16

# The answer
KIND = 112
VALUES = 113

SPEED = 0  # one value: the separation speed
IMPULSE = 1  # three: on b
VELOCITIES = 2  # six: of a, then of b
ASK = 3  # none: ask the law in Python

# Whole numbers
LAW = 0
BRANCH = 1
PARAMETERS = 2
