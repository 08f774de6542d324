"""Dense systems of linear equations, real and complex: Gaussian elimination with partial pivoting, in place, in flat buffers.

An n x n matrix lies row by row from ``at`` on: element (i, j) is ``s[at + i * n + j]``. A complex one lies in two such areas, real and
imaginary parts. ``p[to + k]`` is the row that took the place of row k in step k.

Source: G. H. Golub, C. F. Van Loan, Matrix Computations, 4th ed. 2013, 3.4; complex quotients as R. L. Smith, Comm. ACM 5 (1962) 435.
"""


def factor(s: list[float], at: int, n: int, p: list[int], to: int) -> bool:
    """Factor the matrix in place, P A = L U; False if it is singular, or not finite."""
    for k in range(n):
        row = at + k * n
        best, size = k, abs(s[row + k])
        for i in range(k + 1, n):
            here = abs(s[at + i * n + k])
            if here > size:
                best, size = i, here
        p[to + k] = best
        if not 0.0 < size < 1e300:
            return False
        if best != k:
            other = at + best * n
            for j in range(n):
                kept = s[row + j]
                s[row + j] = s[other + j]
                s[other + j] = kept
        pivot = s[row + k]
        for i in range(k + 1, n):
            below = at + i * n
            by = s[below + k] / pivot
            s[below + k] = by
            if by != 0.0:
                for j in range(k + 1, n):
                    s[below + j] = s[below + j] - by * s[row + j]
    return True


def solve(s: list[float], at: int, n: int, p: list[int], to: int, b: int) -> None:
    """Put in place of the right side, ``s[b]`` and on, the solution of the system that `factor` has factored."""
    for k in range(n):
        best = p[to + k]
        kept = s[b + best]
        s[b + best] = s[b + k]
        s[b + k] = kept
    for i in range(1, n):
        row = at + i * n
        total = s[b + i]
        for j in range(i):
            total = total - s[row + j] * s[b + j]
        s[b + i] = total
    for i in range(n - 1, -1, -1):
        row = at + i * n
        total = s[b + i]
        for j in range(i + 1, n):
            total = total - s[row + j] * s[b + j]
        s[b + i] = total / s[row + i]


def quotient(a: float, b: float, c: float, d: float) -> tuple[float, float]:
    """(a + i b) / (c + i d), where the divisor is not 0."""
    if abs(c) >= abs(d):
        r = d / c
        by = c + d * r
        return (a + b * r) / by, (b - a * r) / by
    r = c / d
    by = c * r + d
    return (a * r + b) / by, (b * r - a) / by


def factor_complex(s: list[float], re: int, im: int, n: int, p: list[int], to: int) -> bool:
    """As `factor`, for the complex matrix with its real parts at ``re`` and its imaginary parts at ``im``."""
    for k in range(n):
        row, row_im = re + k * n, im + k * n
        best, size = k, abs(s[row + k]) + abs(s[row_im + k])
        for i in range(k + 1, n):
            here = abs(s[re + i * n + k]) + abs(s[im + i * n + k])
            if here > size:
                best, size = i, here
        p[to + k] = best
        if not 0.0 < size < 1e300:
            return False
        if best != k:
            other, other_im = re + best * n, im + best * n
            for j in range(n):
                kept, kept_im = s[row + j], s[row_im + j]
                s[row + j] = s[other + j]
                s[row_im + j] = s[other_im + j]
                s[other + j] = kept
                s[other_im + j] = kept_im
        c, d = s[row + k], s[row_im + k]
        for i in range(k + 1, n):
            below, below_im = re + i * n, im + i * n
            by, by_im = quotient(s[below + k], s[below_im + k], c, d)
            s[below + k] = by
            s[below_im + k] = by_im
            if by != 0.0 or by_im != 0.0:
                for j in range(k + 1, n):
                    x, y = s[row + j], s[row_im + j]
                    s[below + j] = s[below + j] - (by * x - by_im * y)
                    s[below_im + j] = s[below_im + j] - (by * y + by_im * x)
    return True


def solve_complex(s: list[float], re: int, im: int, n: int, p: list[int], to: int, b: int, b_im: int) -> None:
    """As `solve`, for a matrix that `factor_complex` has factored; the right side lies at ``b`` and ``b_im``."""
    for k in range(n):
        best = p[to + k]
        kept, kept_im = s[b + best], s[b_im + best]
        s[b + best] = s[b + k]
        s[b_im + best] = s[b_im + k]
        s[b + k] = kept
        s[b_im + k] = kept_im
    for i in range(1, n):
        row, row_im = re + i * n, im + i * n
        total, total_im = s[b + i], s[b_im + i]
        for j in range(i):
            x, y = s[b + j], s[b_im + j]
            total = total - (s[row + j] * x - s[row_im + j] * y)
            total_im = total_im - (s[row + j] * y + s[row_im + j] * x)
        s[b + i] = total
        s[b_im + i] = total_im
    for i in range(n - 1, -1, -1):
        row, row_im = re + i * n, im + i * n
        total, total_im = s[b + i], s[b_im + i]
        for j in range(i + 1, n):
            x, y = s[b + j], s[b_im + j]
            total = total - (s[row + j] * x - s[row_im + j] * y)
            total_im = total_im - (s[row + j] * y + s[row_im + j] * x)
        s[b + i], s[b_im + i] = quotient(total, total_im, s[row + i], s[row_im + i])
