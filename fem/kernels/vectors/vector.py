"""Numba type of a SIMD vector: ``WIDTH`` doubles (lanes), one for each of as many elements, and its arithmetic.

A kernel reads a SIMD vector with ``memory.load`` and then writes ``a * b + c`` as for scalars: the compiler emits
vector instructions, keeps values in registers and need not prove that arrays do not overlap, as it must in a loop over
lanes. Functions of tuples of scalars, such as ``kernels.lanes.times``, also take tuples of SIMD vectors.
"""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model

from reflowshock.fem.kernels.lanes import LANE_OPTIONS

WIDTH = 4  # doubles of a 256-bit register
VECTOR_OPTIONS = LANE_OPTIONS | {"forceinline": True}  # called functions would take vectors through memory
DOUBLES = ir.VectorType(ir.DoubleType(), WIDTH)


class Vector(types.Type):
    """Numba type of a SIMD vector of ``WIDTH`` doubles; kernels see its only instance, ``VECTOR``."""

    def __init__(self) -> None:
        """Name the type."""
        super().__init__(name=f"Vector{WIDTH}")


VECTOR = Vector()


@register_model(Vector)
class VectorModel(models.PrimitiveModel):
    """Representation of the Numba type ``Vector`` in memory: one value of LLVM's vector type."""

    def __init__(self, manager: Any, kind: Any) -> None:
        """Declare the representation."""
        super().__init__(manager, kind, DOUBLES)


def constant(value: float) -> ir.Constant:
    """Return an LLVM constant, a SIMD vector of ``WIDTH`` lanes with the same value in all of them.

    Args:
        value: Value of each lane.
    """
    return ir.Constant(DOUBLES, [ir.Constant(ir.DoubleType(), value)] * WIDTH)


def spread(builder: Any, value: Any) -> Any:
    """Generate the LLVM code that copies a scalar to all ``WIDTH`` lanes of a SIMD vector, and return its LLVM value.

    Args:
        builder: LLVM instruction builder (``llvmlite.ir.IRBuilder``), to which instructions are appended.
        value: LLVM value, a scalar; SIMD vectors are returned unchanged.
    """
    if isinstance(value.type, ir.VectorType):
        return value
    unknown = ir.Constant(ir.VectorType(value.type, WIDTH), ir.Undefined)
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [ir.IntType(32)(0)] * WIDTH)
    return builder.shuffle_vector(builder.insert_element(unknown, value, ir.IntType(32)(0)), unknown, zeros)


def _lowered(instruction: str) -> Callable:
    """Return the function that generates a binary instruction for two vectors, or a vector and a scalar."""

    def generate(context: Any, builder: Any, kind: Any, arguments: Any) -> Any:
        left, right = (spread(builder, value) for value in arguments)
        return getattr(builder, instruction)(left, right)

    return generate


def _negative(context: Any, builder: Any, kind: Any, arguments: Any) -> Any:
    """Generate the negative of a vector."""
    return builder.fneg(arguments[0])


BINARY = {operator.add: "fadd", operator.sub: "fsub", operator.mul: "fmul", operator.truediv: "fdiv"}
PAIRS = ((VECTOR, VECTOR), (VECTOR, types.float64), (types.float64, VECTOR))
for _function, _instruction in BINARY.items():
    infer_global(_function)(
        type("VectorOperation", (ConcreteTemplate,), {"cases": [signature(VECTOR, *pair) for pair in PAIRS]})
    )
    for _pair in PAIRS:
        lower_builtin(_function, *_pair)(_lowered(_instruction))
infer_global(operator.neg)(type("VectorNegative", (ConcreteTemplate,), {"cases": [signature(VECTOR, VECTOR)]}))
lower_builtin(operator.neg, VECTOR)(_negative)
