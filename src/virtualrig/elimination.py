"""Linear systems of the pump's chambers, solved in place."""

from virtualrig.compilation import step_function


@step_function
def eliminate(matrix):
    """Solve in place, right-hand side in the last column; diagonally dominant, so without
    pivots.
    """
    n = matrix.shape[0]
    for k in range(n):
        pivot = 1.0 / matrix[k, k]
        for i in range(k + 1, n):
            factor = matrix[i, k] * pivot
            if factor != 0.0:
                for j in range(k + 1, n + 1):
                    matrix[i, j] -= factor * matrix[k, j]
    for k in range(n - 1, -1, -1):
        total = matrix[k, n]
        for j in range(k + 1, n):
            total -= matrix[k, j] * matrix[j, n]
        matrix[k, n] = total / matrix[k, k]


@step_function
def eliminate_arrow(matrix):
    """The same where only the diagonal, the last row and the last unknown's column are not zero.

    Sums have the terms that are not zero, in the same order.
    """
    n = matrix.shape[0]
    last = n - 1
    for k in range(last):
        factor = matrix[last, k] * (1.0 / matrix[k, k])
        if factor != 0.0:
            matrix[last, last] -= factor * matrix[k, last]
            matrix[last, n] -= factor * matrix[k, n]
    matrix[last, n] /= matrix[last, last]
    for k in range(last):
        matrix[k, n] = (matrix[k, n] - matrix[k, last] * matrix[last, n]) / matrix[k, k]
