"""Functions of vectors: choice, square root, logarithm and exponential, without branches.

The logarithm and the exponential are polynomials, because library functions take scalars; they are exact to a few units
in the last place. They are summed in pairs (Estrin), since each operation waits for the one before.
"""

import math
from typing import Any

from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

from reflowshock.fem.kernels.vectors.memory import broadcast
from reflowshock.fem.kernels.vectors.vector import DOUBLES, VECTOR, VECTOR_OPTIONS, WIDTH, constant
from reflowshock.materials.plasticity import LARGEST_EXPONENT

LN2 = 0.6931471805599453
ROOT_BITS = 0x3FE6A09E667F3BCD  # of sqrt(1/2): mantissas are taken from there to sqrt(2)
MANTISSA, BIAS = 52, 1023
FACTORS = tuple(1.0 / math.factorial(k) for k in range(13))
LONGS = ir.VectorType(ir.IntType(64), WIDTH)


def _bits(value: int) -> ir.Constant:
    """Return a vector of 64-bit integers with the same value in all lanes."""
    return ir.Constant(LONGS, [ir.Constant(ir.IntType(64), value)] * WIDTH)


def _called(builder: Any, name: str, arguments: Any) -> Any:
    """Return the call of a function of one vector that the compiler knows."""
    kind = ir.FunctionType(DOUBLES, [DOUBLES])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{WIDTH}f64"), arguments)


@intrinsic
def choose(context: Any, a: Any, b: Any, yes: Any, no: Any) -> Any:
    """Return, lane by lane, ``yes`` where a < b and ``no`` elsewhere, a SIMD vector of ``WIDTH`` lanes.

    Args:
        context: Typing context of Numba, supplied by its compiler; kernels call ``choose(a, b, yes, no)``.
        a: First SIMD vector to compare; a lane that is not a number takes ``no``.
        b: Second SIMD vector to compare.
        yes: Values where a < b, SIMD vector.
        no: Values elsewhere, SIMD vector.
    """

    def generate(context: Any, builder: Any, kind: Any, arguments: Any) -> Any:
        return builder.select(builder.fcmp_ordered("<", *arguments[:2]), *arguments[2:])

    return VECTOR(VECTOR, VECTOR, VECTOR, VECTOR), generate


@intrinsic
def root(context: Any, vector: Any) -> Any:
    """Return the square roots of the lanes of a SIMD vector, a SIMD vector.

    Args:
        context: Typing context of Numba, supplied by its compiler; kernels call ``root(vector)``.
        vector: Numbers that are not negative, SIMD vector of ``WIDTH`` lanes.
    """

    def generate(context: Any, builder: Any, kind: Any, arguments: Any) -> Any:
        return _called(builder, "sqrt", arguments)

    return VECTOR(VECTOR), generate


@intrinsic
def nearest(context: Any, vector: Any) -> Any:
    """Return the nearest whole numbers of the lanes of a SIMD vector, a SIMD vector of doubles.

    Args:
        context: Typing context of Numba, supplied by its compiler; kernels call ``nearest(vector)``.
        vector: Numbers to round, SIMD vector of ``WIDTH`` lanes.
    """

    def generate(context: Any, builder: Any, kind: Any, arguments: Any) -> Any:
        return _called(builder, "rint", arguments)

    return VECTOR(VECTOR), generate


@intrinsic
def power_of_two(context: Any, vector: Any) -> Any:
    """Return 2^k of whole numbers k, lane by lane, a SIMD vector.

    Args:
        context: Typing context of Numba, supplied by its compiler; kernels call ``power_of_two(vector)``.
        vector: Whole numbers k from -1022 to 1023 as doubles, SIMD vector of ``WIDTH`` lanes.
    """

    def generate(context: Any, builder: Any, kind: Any, arguments: Any) -> Any:
        shifted = builder.fadd(arguments[0], constant(1.5 * 2.0**MANTISSA))
        exponent = builder.add(builder.bitcast(shifted, LONGS), _bits(BIAS))
        return builder.bitcast(builder.shl(exponent, _bits(MANTISSA)), DOUBLES)

    return VECTOR(VECTOR), generate


@intrinsic
def split(context: Any, vector: Any) -> Any:
    """Return k and m with x = 2^k m, m from sqrt(1/2) to sqrt(2), two SIMD vectors of doubles.

    Args:
        context: Typing context of Numba, supplied by its compiler; kernels call ``split(vector)``.
        vector: Positive normal numbers x, SIMD vector of ``WIDTH`` lanes.
    """

    def generate(context: Any, builder: Any, kind: Any, arguments: Any) -> Any:
        bits, unit = builder.bitcast(arguments[0], LONGS), BIAS << MANTISSA
        biased = builder.lshr(builder.add(bits, _bits(unit - ROOT_BITS)), _bits(MANTISSA))
        k = builder.trunc(builder.sub(biased, _bits(BIAS)), ir.VectorType(ir.IntType(32), WIDTH))
        m = builder.add(builder.sub(bits, builder.shl(biased, _bits(MANTISSA))), _bits(unit))
        return context.make_tuple(builder, kind.return_type, (builder.sitofp(k, DOUBLES), builder.bitcast(m, DOUBLES)))

    return types.UniTuple(VECTOR, 2)(VECTOR), generate


@njit(**VECTOR_OPTIONS)
def larger(a, b):
    """Return the larger of two SIMD vectors ``a`` and ``b`` of ``WIDTH`` lanes, lane by lane."""
    return choose(a, b, b, a)


@njit(**VECTOR_OPTIONS)
def smaller(a, b):
    """Return the smaller of two SIMD vectors ``a`` and ``b`` of ``WIDTH`` lanes, lane by lane."""
    return choose(a, b, a, b)


@njit(**VECTOR_OPTIONS)
def log(x):
    """Return ln x, lane by lane: x = 2^k m, ln m = 2 artanh((m - 1) / (m + 1)) by its series.

    Args:
        x: Positive normal numbers, SIMD vector of ``WIDTH`` lanes.
    """
    k, m = split(x)
    s = (m - 1.0) / (m + 1.0)
    z = s * s
    z2 = z * z
    z4 = z2 * z2
    low = 1.0 / 3.0 + z * (1.0 / 5.0) + z2 * (1.0 / 7.0 + z * (1.0 / 9.0))
    middle = 1.0 / 11.0 + z * (1.0 / 13.0) + z2 * (1.0 / 15.0 + z * (1.0 / 17.0))
    series = low + z4 * (middle + z4 * (1.0 / 19.0 + z * (1.0 / 21.0)))
    return k * LN2 + 2.0 * s * (1.0 + z * series)


@njit(**VECTOR_OPTIONS)
def within(x, largest):
    """Return a SIMD vector ``x`` clipped lane by lane to +- ``largest``, a SIMD vector of positive numbers."""
    return smaller(larger(x, -largest), largest)


@njit(**VECTOR_OPTIONS)
def exp(x):
    """Return e^x, lane by lane: x = k ln 2 + r, series of e^r to r^12.

    Args:
        x: Exponents, SIMD vector of ``WIDTH`` lanes; clipped to +-``LARGEST_EXPONENT``.
    """
    x = within(x, broadcast(LARGEST_EXPONENT))
    k = nearest(x * (1.0 / LN2))
    r = x - k * LN2
    r2 = r * r
    r4 = r2 * r2
    low = FACTORS[2] + r * FACTORS[3] + r2 * (FACTORS[4] + r * FACTORS[5])
    middle = FACTORS[6] + r * FACTORS[7] + r2 * (FACTORS[8] + r * FACTORS[9])
    series = low + r4 * (middle + r4 * (FACTORS[10] + r * FACTORS[11] + r2 * FACTORS[12]))
    power = power_of_two(k)
    return power + power * (r + r2 * series)


@njit(**VECTOR_OPTIONS)
def rough_log(x):
    """Return ln x, lane by lane, with an absolute error of at most 4e-5.

    Args:
        x: Positive normal numbers, SIMD vector of ``WIDTH`` lanes.
    """
    k, m = split(x)
    s = (m - 1.0) / (m + 1.0)
    return k * LN2 + s * (2.0 + s * s * (2.0 / 3.0))


@njit(**VECTOR_OPTIONS)
def rough_exp(x):
    """Return e^x, lane by lane, with a relative error of at most 1e-3.

    Args:
        x: Exponents, SIMD vector of ``WIDTH`` lanes; clipped to +-``LARGEST_EXPONENT``.
    """
    x = within(x, broadcast(LARGEST_EXPONENT))
    k = nearest(x * (1.0 / LN2))
    r = x - k * LN2
    return power_of_two(k) * (1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0))))
