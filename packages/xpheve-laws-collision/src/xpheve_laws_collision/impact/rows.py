"""Where the numbers of the event loop lie: buffers ``f[k]`` of floats and ``n[k]`` of integers, and what their rows hold."""

# Buffers of floats
CONTACT = 0  # what a law reads and answers: see `xpheve.kernels.response`
STATE = 2  # a row a place: its flight
EVENT = 3  # a row a place: what happens to it next
COLD = 4  # a row a place: what only laws ask for
SCENERY = 5  # a row a fixed shape
COLUMNS = 6  # a row a fixed shape: what only laws ask for, then columns
SPACE = 7  # see below
KEYS = 8  # the instant of each place's next event, two floats
WORK = 9  # a law's work [J] and the rest of its compensated sum
PAIR = 10  # two rows as those of STATE: flights as they are at SINCE

# Buffers of integers
LAW = 0  # number, branch and offset of the law that answers
PLACE = 1  # a row a place
COUNTS = 2  # see below
TREE = 3  # the tournament of the keys
HEADS = 4  # the first place of each cell
LISTS = 5  # places to be predicted, then places that have changed, then the answer to a question
MASKS = 6  # of fixed shapes: bits of laws that answer, bits of those that listen
LAWS = 7  # law of each of 64 bits, then a row a law
LINK = 8  # a short row a place: what those nearby look at
SHELVES = 9  # fixed shapes that all look at; where the list of each cell begins; the lists
NEARBY = 10  # lists of places near another one, a row each

# A row of n[NEARBY]
NEARS = 2
LAST_NEARBY = 63
"""A place of the list, and by how many boxes its cell is beyond the box along each axis, one added, in two bits each. Row numbers go round."""

# A row of n[LINK]
LINKS = 4
MASK, STAMP, NEXT, BEFORE = 0, 1, 2, 3
"""Bits of the laws that answer; how often the flight has changed; the places after and before it in the list of its cell."""

# A row of f[STATE]; raw positions and velocities at the place's own clock
STATES = 16
X, V, TIME, PULL, RADIUS, INVERSE, WRAPS = 0, 3, 6, 8, 11, 12, 13
"""WRAPS: how many box lengths the place has gone beyond the box since its clock, by its cell."""

# A row of f[EVENT]
EVENTS = 16
MEETS, SHIFT, HITS, LEAVES, LAST = 0, 2, 5, 7, 9
"""Instants of the next impact with a place (and the box lengths [m] to add to the partner), with scenery, of leaving the cell; of the last impact."""

# A row of f[COLD]
COLDS = 32
SPIN, MASS, INERTIA, TURNING, TURN_TIME, OWN = 0, 3, 4, 8, 12, 16
"""TURNING: the orientation at TURN_TIME."""

# A row of f[SCENERY]
SCENERIES = 24
KIND, CENTRE, TURN, SIZE = 0, 1, 4, 13

# A row of f[COLUMNS]
FIXED = 32
STANDS, FACES, WEIGHS, MOMENTS, ITS = 0, 3, 7, 8, 16
"""Position, orientation, mass and moments of inertia of a fixed body, and its columns."""
SPHERE, PLANE, BOX, CAPSULE = 0, 1, 2, 3

# A row of n[PLACE]
PLACES = 24
QUIET = 0
FOLDED = 1
HEARD, RANK, SKIP, WATCHED = 4, 5, 6, 7
CELL, CELL_AT, WAY, PARTNER, SEEN, MEETS_HOW, WALL, HITS_HOW = 8, 9, 12, 13, 14, 15, 16, 17
STREAK, STREAK_WITH, CHANGED, DIRTY, PRESENT, TURNED = 18, 19, 20, 21, 22, 23
"""FOLDED: the coordinates of the list the place is in, and CELL: which that is; CELL_AT: its three coordinates in cells, counted on from those of
its flight's beginning; WAY: how it leaves."""

# f[SPACE]
LIMIT, BOX, WIDTH, FRAME_TIME, FRAME, BUSY_AT, AT, SINCE = 0, 2, 5, 8, 10, 19, 21, 23
"""FRAME: origin, velocity and acceleration of the cells, at FRAME_TIME; AT: instant of what the loop stopped for; SINCE: scenery and laws are
as they are from then on, and what would have been before is none."""
SPACES = 26

# n[COUNTS]
JOB, COUNT, SCENES, CELLED, GRID, PERIODIC, SAME_TIME, DIRTIES, CHANGES = 0, 1, 2, 3, 4, 7, 10, 11, 12
IMPACTS, PREDICTIONS, CROSSINGS, STALE, LEAVES_OF_TREE, ADDRESS, OWN_COLUMNS = 13, 14, 15, 16, 17, 18, 19
WHO, WITH, WITH_SCENERY, BUDGET, MOST_AT_ONCE, FOUND, GIVEN, ENDLESS = 20, 21, 22, 23, 24, 25, 26, 27
COUNTED = 32

# A row of n[LAWS], after the laws of the bits
BITS = 64
LAW_ROWS = 4
BRANCH, OFFSET, ASKED = 0, 1, 2

# How an event is meant
NOTHING, IMPACT, REST = 0, 1, 2
TOUCHES = 4
"""Added to the others where the pair touches at the instant from which it was looked at."""

# Why the loop stops
LIMITED, BY_LAW, TOUCHED, RESTED, COLLAPSED, STREAKED, BUSY, FAILED, SEEN_BY, PAUSED = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9
