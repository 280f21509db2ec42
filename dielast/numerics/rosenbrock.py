"""Rosenbrock methods as tables of coefficients.

For M y' = f(t, y) with Jacobian J and step h, in the form free of matrix-vector products (Hairer and Wanner, Solving ODEs II,
IV.7):

    (M/gamma - h J) u_i = h f(t + alpha_i h, y + sum_j a_ij u_j) + M sum_j c_ij u_j + h^2 gamma_i df/dt,
    y_1 = y + sum_j a_sj u_j + u_s,    error estimate u_s,
    y(theta) = (1 - theta) y + theta (y_1 + (1 - theta) (k_1 + theta (k_2 + theta k_3))),    k_i = sum_j dense_ij u_j.

All methods here are stiffly accurate: the last two increments enter y_1 with weight 1, so the embedded solution is y_1 - u_s.
"""

from dataclasses import dataclass, field

import numpy as np

from dielast.numerics.arrays import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Rosenbrock:
    """Coefficients of an s-stage method: `a`, `c` strictly lower triangular (s, s), `alpha`, `gamma_i` (s,), `dense` (3, s).

    `ac` are the rows of a and c for the increments before each stage, (2, stage); `adds_last` marks stages whose state is that of
    the stage before plus its increment; `middle` (s,) are the weights of the dense output in the middle of a step.
    """

    name: str
    order: int
    gamma: float
    alpha: Floats
    gamma_i: Floats
    a: Floats
    c: Floats
    dense: Floats
    ac: tuple[Floats, ...] = field(init=False)
    middle: Floats = field(init=False)
    adds_last: tuple[bool, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "ac", tuple(np.stack((a[:i], c[:i])) for i, (a, c) in enumerate(zip(self.a, self.c, strict=True))))
        object.__setattr__(self, "middle", np.array((0.25, 0.125, 0.0625)) @ self.dense)
        steps = self.a - np.roll(self.a, 1, axis=0)
        unit = np.eye(self.alpha.size, k=-1)
        object.__setattr__(self, "adds_last", tuple(bool(i > 1 and np.all(steps[i] == unit[i])) for i in range(self.alpha.size)))

    @property
    def stages(self) -> int:
        """Number of stages s."""
        return self.alpha.size


def _lower(rows: tuple[tuple[float, ...], ...]) -> Floats:
    """Strictly lower triangular matrix from its rows; the first row, which is empty, is omitted."""
    matrix = np.zeros((len(rows) + 1, len(rows) + 1))
    for i, row in enumerate(rows, start=1):
        matrix[i, : len(row)] = row
    return matrix


_A6 = (-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946)

# G. Steinebach, Construction of Rosenbrock-Wanner method Rodas5P and numerical benchmarks within the Julia Differential Equations
# package, BIT Numer. Math. 63 (2023) 27, DOI 10.1007/s10543-023-00967-x: order 5 for index-1 DAEs, L-stable, dense output of
# order 4, no order reduction on the Prothero-Robinson problem.
RODAS5P = Rosenbrock(
    name="Rodas5P",
    order=5,
    gamma=0.21193756319429014,
    alpha=np.array((0.0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716, 0.4288403609558664, 1.0, 1.0, 1.0)),
    gamma_i=np.array(
        (0.21193756319429014, -0.42387512638858027, -0.3384627126235924, 1.8046452872882734, 2.325825639765069, 0.0, 0.0, 0.0)
    ),
    a=_lower(
        (
            (3.0,),
            (2.849394379747939, 0.45842242204463923),
            (-6.954028509809101, 2.489845061869568, -10.358996098473584),
            (2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641),
            _A6,
            (*_A6, 1.0),
            (*_A6, 1.0, 1.0),
        )
    ),
    c=_lower(
        (
            (-14.155112264123755,),
            (-17.97296035885952, -2.859693295451294),
            (147.12150275711716, -1.41221402718213, 71.68940251302358),
            (165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306),
            (24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125, -0.6610691825249471),
            (
                30.91273214028599,
                -3.1208243349937974,
                77.79954646070892,
                34.28646028294783,
                -19.097331116725623,
                -28.087943162872662,
            ),
            (
                37.80277123390563,
                -3.2571969029072276,
                112.26918849496327,
                66.9347231244047,
                -40.06618937091002,
                -54.66780262877968,
                -9.48861652309627,
            ),
        )
    ),
    dense=np.array(
        (
            (
                25.948786856663858,
                -2.5579724845846235,
                10.433815404888879,
                -2.3679251022685204,
                0.524948541321073,
                1.1241088310450404,
                0.4272876194431874,
                -0.17202221070155493,
            ),
            (
                -9.91568850695171,
                -0.9689944594115154,
                3.0438037242978453,
                -24.495224566215796,
                20.176138334709044,
                15.98066361424651,
                -6.789040303419874,
                -6.710236069923372,
            ),
            (
                11.419903575922262,
                2.8879645146136994,
                72.92137995996029,
                80.12511834622643,
                -52.072871366152654,
                -59.78993625266729,
                -0.15582684282751913,
                4.883087185713722,
            ),
        )
    ),
)
