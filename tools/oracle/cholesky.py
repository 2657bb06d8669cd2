"""Float64 reference of the factorisation and the solution, by scipy.linalg."""

import numpy as np
from scipy.linalg import cho_factor, cho_solve

import emit
from rig import to_q, from_q

DIAGONAL = 0.99
# Beyond this condition L and x cannot be distinguished from rounding errors of A; the test then
# looks at residuals alone.
CONDITION_MAX = 1e4


def packed(matrix):
    return matrix[np.tril_indices(len(matrix))]


def scaled(matrix):
    """Diagonal 0.99 and rounded to Q30."""
    scale = np.sqrt(DIAGONAL / np.diag(matrix))
    return to_q(matrix * scale[:, None] * scale, 30)


def random_matrix(random, n, condition):
    """Eigenvalues spread evenly on a log scale."""
    basis, _ = np.linalg.qr(random.standard_normal((n, n)))
    values = np.logspace(0, -np.log10(condition), n) if n > 1 else np.ones(1)
    return scaled(basis * values @ basis.T)


def write_vectors(directory):
    random = np.random.default_rng(31)
    systems = [("one", random_matrix(random, 1, 1)),
               ("two", random_matrix(random, 2, 10)),
               ("easy", random_matrix(random, 5, 10)),
               ("usual", random_matrix(random, 6, 1e3)),
               ("hard", random_matrix(random, 6, 1e5)),
               ("extreme", random_matrix(random, 6, 1e7))]
    inc = emit.Inc("Positive definite systems, their factors and solutions in float64.")
    rows = []
    for name, matrix_q30 in systems:
        n = len(matrix_q30)
        matrix = from_q(matrix_q30, 30)
        factor, _ = cho_factor(matrix, lower=True)
        truth = random.uniform(-1, 1, n) * 2.0 ** random.integers(0, 3, n)
        right = to_q(matrix @ truth, 24)
        condition = np.linalg.cond(matrix)
        arrays = ["a_q30", "b"]
        inc.array("int32_t", "vector_%s_a_q30" % name, packed(matrix_q30))
        inc.array("int32_t", "vector_%s_b" % name, right)
        if condition < CONDITION_MAX:
            arrays += ["last_row", "diagonal", "x"]
            solution = cho_solve((factor, True), right.astype(float))
            inc.array("double", "vector_%s_last_row" % name, np.tril(factor)[-1], 10)
            inc.array("double", "vector_%s_diagonal" % name, np.diag(factor), 10)
            inc.array("double", "vector_%s_x" % name, solution, 1)
        rows.append('"%s", %d, %.3g,\n     %s' % (name, n, condition, ", ".join(
            ["vector_%s_%s" % (name, a) for a in arrays] + ["0"] * (5 - len(arrays)))))
    inc.struct_array("vector_system", "vector_systems", rows)
    return inc.write(directory, "cholesky.inc")
