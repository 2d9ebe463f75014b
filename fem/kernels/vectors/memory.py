"""Intrinsics that move SIMD vectors between registers and memory, without checks of bounds or overlap.

Arrays are passed on as pointers (``place``): Numba would count a reference to an array at each call. A position counts
entries of the array from the pointer on.
"""

from typing import Any

from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

from reflowshock.fem.kernels.vectors.vector import DOUBLES, VECTOR, VECTOR_OPTIONS, WIDTH, constant, spread

LONG, INDEX, BYTE = ir.IntType(64), ir.IntType(32), ir.IntType(8)
PAIR = ir.VectorType(ir.DoubleType(), 2)
LINE = 8  # doubles of a cache line


@intrinsic
def place(context: Any, values: Any) -> Any:
    """Return the pointer to the first entry of an array; it is valid while the array exists.

    Args:
        context: Typing context of Numba, supplied by its compiler; kernels call ``place(values)``.
        values: Contiguous array of any shape and type.
    """

    def generate(context: Any, builder: Any, kind: Any, arguments: Any) -> Any:
        return context.make_array(kind.args[0])(context, builder, arguments[0]).data

    return types.CPointer(values.dtype)(values), generate


@intrinsic
def load(context: Any, values: Any, at: Any) -> Any:
    """Return ``WIDTH`` consecutive doubles as a SIMD vector.

    Args:
        context: Typing context of Numba, supplied by its compiler; kernels call ``load(values, at)``.
        values: Pointer to an array of doubles, from ``place``.
        at: Position of the first double, integer.
    """

    def generate(context: Any, builder: Any, kind: Any, arguments: Any) -> Any:
        address = builder.bitcast(builder.gep(arguments[0], [arguments[1]]), DOUBLES.as_pointer())
        return builder.load(address, align=8)

    return VECTOR(values, types.intp), generate


@intrinsic
def store(context: Any, values: Any, at: Any, vector: Any) -> Any:
    """Write a SIMD vector to ``WIDTH`` consecutive doubles.

    Args:
        context: Typing context of Numba, supplied by its compiler; kernels call ``store(values, at, vector)``.
        values: Pointer to an array of doubles, from ``place``; the array is overwritten there.
        at: Position of the first double, integer.
        vector: Values, SIMD vector of ``WIDTH`` lanes.
    """

    def generate(context: Any, builder: Any, kind: Any, arguments: Any) -> Any:
        address = builder.bitcast(builder.gep(arguments[0], [arguments[1]]), DOUBLES.as_pointer())
        builder.store(arguments[2], address, align=8)
        return context.get_dummy_value()

    return types.none(values, types.intp, VECTOR), generate


def _rows(builder: Any, values: Any, nodes: Any, at: Any) -> list[Any]:
    """Return the addresses of the rows of ``WIDTH`` nodes whose numbers are consecutive in memory."""
    numbers = [builder.load(builder.gep(nodes, [builder.add(at, LONG(lane))])) for lane in range(WIDTH)]
    return [builder.gep(values, [builder.mul(builder.sext(number, LONG), LONG(3))]) for number in numbers]


@intrinsic
def gather(context: Any, values: Any, nodes: Any, at: Any) -> Any:
    """Return the rows of ``WIDTH`` nodes as a tuple (x, y, z) of three SIMD vectors.

    Args:
        context: Typing context of Numba, supplied by its compiler; kernels call ``gather(values, nodes, at)``.
        values: Pointer to nodal values of three components, shape (n, 3) float64.
        nodes: Pointer to node numbers, int32.
        at: Position of the node of lane 0 in the node numbers, integer; lane i has the node at position ``at + i``.
    """

    def generate(context: Any, builder: Any, kind: Any, arguments: Any) -> Any:
        x = y = z = ir.Constant(DOUBLES, ir.Undefined)
        for lane, row in enumerate(_rows(builder, *arguments)):
            pair = builder.load(builder.bitcast(row, PAIR.as_pointer()), align=8)
            x = builder.insert_element(x, builder.extract_element(pair, INDEX(0)), INDEX(lane))
            y = builder.insert_element(y, builder.extract_element(pair, INDEX(1)), INDEX(lane))
            z = builder.insert_element(z, builder.load(builder.gep(row, [LONG(2)])), INDEX(lane))
        return context.make_tuple(builder, kind.return_type, (x, y, z))

    return types.UniTuple(VECTOR, 3)(values, nodes, types.intp), generate


@intrinsic
def subtract(context: Any, values: Any, nodes: Any, at: Any, vectors: Any) -> Any:
    """Subtract a tuple (x, y, z) of three SIMD vectors from the rows of ``WIDTH`` nodes, lane by lane.

    Args:
        context: Typing context of Numba, supplied by its compiler; kernels call ``subtract(values, nodes, at,
            vectors)``.
        values: Pointer to nodal values of three components, shape (n, 3) float64, subtracted from.
        nodes: Pointer to node numbers, int32; lanes may have the same node.
        at: Position of the node of lane 0 in the node numbers, integer; lane i has the node at position ``at + i``.
        vectors: Values to subtract, tuple (x, y, z) of three SIMD vectors.
    """

    def generate(context: Any, builder: Any, kind: Any, arguments: Any) -> Any:
        x, y, z = cgutils.unpack_tuple(builder, arguments[3], 3)
        for lane, row in enumerate(_rows(builder, *arguments[:3])):
            address, last = builder.bitcast(row, PAIR.as_pointer()), builder.gep(row, [LONG(2)])
            pair = builder.shuffle_vector(
                x, y, ir.Constant(ir.VectorType(INDEX, 2), [INDEX(lane), INDEX(WIDTH + lane)])
            )
            builder.store(builder.fsub(builder.load(address, align=8), pair), address, align=8)
            rest = builder.extract_element(z, INDEX(lane))
            builder.store(builder.fsub(builder.load(last), rest), last)
        return context.get_dummy_value()

    return types.none(values, nodes, types.intp, types.UniTuple(VECTOR, 3)), generate


@intrinsic
def broadcast(context: Any, value: Any) -> Any:
    """Return a SIMD vector of ``WIDTH`` lanes with a scalar in all lanes.

    Args:
        context: Typing context of Numba, supplied by its compiler; kernels call ``broadcast(value)``.
        value: Scalar, float64.
    """

    def generate(context: Any, builder: Any, kind: Any, arguments: Any) -> Any:
        return spread(builder, arguments[0])

    return VECTOR(types.float64), generate


@intrinsic
def all_below(context: Any, vector: Any, limit: Any) -> Any:
    """Return whether all lanes of a SIMD vector are below a scalar; False with a lane that is not a number.

    Args:
        context: Typing context of Numba, supplied by its compiler; kernels call ``all_below(vector, limit)``.
        vector: SIMD vector of ``WIDTH`` lanes.
        limit: Scalar, float64.
    """

    def generate(context: Any, builder: Any, kind: Any, arguments: Any) -> Any:
        below = builder.fcmp_ordered("<", arguments[0], spread(builder, arguments[1]))
        bits = builder.bitcast(below, ir.IntType(WIDTH))
        return builder.icmp_unsigned("==", bits, ir.IntType(WIDTH)(2**WIDTH - 1))

    return types.boolean(VECTOR, types.float64), generate


@intrinsic
def first_lanes(context: Any, vector: Any, count: Any) -> Any:
    """Return a SIMD vector with zeros after its first ``count`` lanes.

    Args:
        context: Typing context of Numba, supplied by its compiler; kernels call ``first_lanes(vector, count)``.
        vector: SIMD vector of ``WIDTH`` lanes.
        count: Number of lanes that stay, integer.
    """

    def generate(context: Any, builder: Any, kind: Any, arguments: Any) -> Any:
        numbers = ir.Constant(ir.VectorType(LONG, WIDTH), [LONG(lane) for lane in range(WIDTH)])
        limit = spread(builder, arguments[1])
        return builder.select(builder.icmp_signed("<", numbers, limit), arguments[0], constant(0.0))

    return VECTOR(VECTOR, types.intp), generate


@intrinsic
def total(context: Any, vector: Any) -> Any:
    """Return the sum of all lanes of a SIMD vector, a scalar.

    Args:
        context: Typing context of Numba, supplied by its compiler; kernels call ``total(vector)``.
        vector: SIMD vector of ``WIDTH`` lanes.
    """

    def generate(context: Any, builder: Any, kind: Any, arguments: Any) -> Any:
        result = builder.extract_element(arguments[0], INDEX(0))
        for lane in range(1, WIDTH):
            result = builder.fadd(result, builder.extract_element(arguments[0], INDEX(lane)))
        return result

    return types.float64(VECTOR), generate


@intrinsic
def prefetch(context: Any, values: Any, at: Any) -> Any:
    """Move the cache line of one entry behind a pointer into the cache; returns nothing and changes no values.

    Args:
        context: Typing context of Numba, supplied by its compiler; kernels call ``prefetch(values, at)``.
        values: Pointer to an array, from ``place``.
        at: Position of the entry, integer; positions outside the array are allowed.
    """

    def generate(context: Any, builder: Any, kind: Any, arguments: Any) -> Any:
        flags = [INDEX(0), INDEX(3), INDEX(1)]  # to read it, in all levels of the cache, as data
        kinds = [BYTE.as_pointer(), *[flag.type for flag in flags]]
        function = cgutils.get_or_insert_function(
            builder.module, ir.FunctionType(ir.VoidType(), kinds), "llvm.prefetch.p0i8"
        )
        builder.call(function, [builder.bitcast(builder.gep(arguments[0], list(arguments[1:])), kinds[0]), *flags])
        return context.get_dummy_value()

    return types.none(values, types.intp), generate


@njit(**VECTOR_OPTIONS)
def prefetch_range(values, at, count):
    """Move doubles behind a pointer into the cache; returns nothing and changes no values.

    Args:
        values: Pointer to an array of doubles, from ``place``.
        at: Position of the first double, integer.
        count: Number of doubles, integer.
    """
    for k in range(at, at + count, LINE):
        prefetch(values, k)


@njit(**VECTOR_OPTIONS)
def three(values, at):
    """Return three SIMD vectors of ``WIDTH`` lanes that follow each other in memory, a tuple.

    Args:
        values: Pointer to an array of doubles, from ``place``.
        at: Position of the first double, integer.
    """
    return load(values, at), load(values, at + WIDTH), load(values, at + 2 * WIDTH)


@njit(**VECTOR_OPTIONS)
def six(values, at):
    """Return six SIMD vectors of ``WIDTH`` lanes that follow each other in memory, a tuple.

    Args:
        values: Pointer to an array of doubles, from ``place``.
        at: Position of the first double, integer.
    """
    return three(values, at) + three(values, at + 3 * WIDTH)


@njit(**VECTOR_OPTIONS)
def nine(values, at):
    """Return nine SIMD vectors of ``WIDTH`` lanes that follow each other in memory, a tuple.

    Args:
        values: Pointer to an array of doubles, from ``place``.
        at: Position of the first double, integer.
    """
    return six(values, at) + three(values, at + 6 * WIDTH)


@njit(**VECTOR_OPTIONS)
def put_three(values, at, vectors):
    """Write three SIMD vectors one after the other to ``3 WIDTH`` consecutive doubles.

    Args:
        values: Pointer to an array of doubles, from ``place``; the array is overwritten there.
        at: Position of the first double, integer.
        vectors: Tuple of three SIMD vectors.
    """
    store(values, at, vectors[0])
    store(values, at + WIDTH, vectors[1])
    store(values, at + 2 * WIDTH, vectors[2])


@njit(**VECTOR_OPTIONS)
def put_six(values, at, vectors):
    """Write six SIMD vectors one after the other to ``6 WIDTH`` consecutive doubles.

    Args:
        values: Pointer to an array of doubles, from ``place``; the array is overwritten there.
        at: Position of the first double, integer.
        vectors: Tuple of six SIMD vectors.
    """
    put_three(values, at, vectors[:3])
    put_three(values, at + 3 * WIDTH, vectors[3:])
