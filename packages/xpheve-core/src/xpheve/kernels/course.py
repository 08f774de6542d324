"""Where rows that only act are at a time: polynomials, piece by piece.

``g`` holds, for each of ``count`` rows: the row, how many pieces there are, their degree, and where they begin in ``g``. A piece is when it begins,
2 over its length, then the Chebyshev coefficients of three coordinates and, after these, of three velocities. A degree below 0 says that pieces are
parabolas: when one begins, as two numbers, then position, velocity and acceleration there. Buffers are flat.

Source: C. W. Clenshaw, Math. Tables Aids Comput. 9 (1955) 118 (the sum of a Chebyshev series).
"""

HEAD = 4
"""Numbers a row has before all pieces."""


def follow(s: list[float], g: list[float], count: int, rows: int, x: int, v: int, moves: int, now: float) -> int:
    """Write the places [m] of the ``count`` rows at ``now`` [s] to ``s[x + c * rows + row]``; velocities [m/s] to ``s[v + ...]``, if ``moves``."""
    for k in range(count):
        row = int(g[4 * k])
        pieces = int(g[4 * k + 1])
        size = int(g[4 * k + 2]) + 1
        first = int(g[4 * k + 3])
        width = 6 * size + 2 if size > 0 else 11
        low = 0
        high = pieces
        while high - low > 1:
            middle = (low + high) // 2
            if now >= g[first + middle * width]:
                low = middle
            else:
                high = middle
        at = first + low * width
        if size <= 0:
            h = (now - g[at]) - g[at + 1]
            for c in range(3):
                s[x + c * rows + row] = g[at + 2 + c] + h * (g[at + 5 + c] + 0.5 * h * g[at + 8 + c])
                if moves != 0:
                    s[v + c * rows + row] = g[at + 5 + c] + h * g[at + 8 + c]
            continue
        u = (now - g[at]) * g[at + 1] - 1.0
        for c in range(3):
            s[x + c * rows + row] = series(g, at + 2 + c * size, size, u)
            if moves != 0:
                s[v + c * rows + row] = series(g, at + 2 + (3 + c) * size, size, u)
    return count


def series(g: list[float], first: int, size: int, u: float) -> float:
    """The sum of ``g[first + m] T_m(u)`` for m below ``size``."""
    b1 = 0.0
    b2 = 0.0
    for m in range(size - 1):
        b0 = 2.0 * u * b1 - b2 + g[first + size - 1 - m]
        b2 = b1
        b1 = b0
    return u * b1 - b2 + g[first]
