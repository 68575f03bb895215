"""Bicubic interpolation of grey values (Keys 1981), for compiled code: eight places at once as LLVM's vectors, as numba finds none there."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

SHARPNESS = -0.75
"""Slope of Keys' kernel at a distance of one pixel, as in OpenCV; -0.5 would be the gentlest that is used."""
EIGHT = 8
"""Places at once."""

_FLOAT, _INT = ir.FloatType(), ir.IntType(32)
_FLOATS, _INTS = ir.VectorType(_FLOAT, EIGHT), ir.VectorType(_INT, EIGHT)


def _numbers(value: float) -> ir.Constant:
    return ir.Constant(_FLOATS, [float(np.float32(value))] * EIGHT)


def _bits(value: int) -> ir.Constant:
    return ir.Constant(_INTS, [value] * EIGHT)


def _eight(context: Any, builder: Any, kind: Any, array: Any, at: Any, vector: ir.VectorType) -> Any:
    """Where eight elements of an array stand, from an index on."""
    place = builder.gep(context.make_array(kind)(context, builder, array).data, [at])
    return builder.bitcast(place, vector.as_pointer())


def _weights(builder: Any, x: Any) -> list[Any]:
    """Of the four pixels around places, by how far (0 to 1) these are between the middle two."""
    other = builder.fsub(_numbers(1.0), x)
    product = builder.fmul(builder.fmul(x, other), _numbers(SHARPNESS))
    near = []
    for far in (x, other):
        cubes = builder.fsub(builder.fmul(far, _numbers(SHARPNESS + 2.0)), _numbers(SHARPNESS + 3.0))
        near.append(builder.fadd(builder.fmul(cubes, builder.fmul(far, far)), _numbers(1.0)))
    return [builder.fmul(product, other), *near, builder.fmul(product, x)]


def _row(builder: Any, data: Any, places: list[Any], weights: list[Any]) -> Any:
    """Weighted grey values of four pixels from each place on."""
    pixels: Any = ir.Constant(_INTS, ir.Undefined)
    for k, place in enumerate(places):
        four = builder.load(builder.bitcast(builder.gep(data, [place]), _INT.as_pointer()), align=1)
        pixels = builder.insert_element(pixels, four, ir.Constant(_INT, k))
    total = None
    for k, weight in enumerate(weights):
        grey = builder.and_(builder.lshr(pixels, _bits(8 * k)), _bits(255))
        part = builder.fmul(builder.sitofp(grey, _FLOATS), weight)
        total = part if total is None else builder.fadd(total, part)
    return total


@intrinsic
def cubic(typing, image, stride, places, x, y, out, at):  # type: ignore[no-untyped-def]
    """out[at …] (float32) = grey values at eight places: as far as x[at …] and y[at …] (float32, 0 to 1) from the pixels image[places[at …]] (int32) to
    the next column and row; `stride`: pixels of a row, uint8. Lowest bytes of a number come first."""
    signature = types.void(image, types.intp, places, x, y, out, types.intp)

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        image_, stride_, places_, x_, y_, out_, at_ = args
        kind = signature.args
        data = context.make_array(kind[0])(context, builder, image_).data
        across, down = (
            _weights(builder, builder.load(_eight(context, builder, kind[n], array, at_, _FLOATS), align=4))
            for n, array in ((3, x_), (4, y_))
        )
        pixel = builder.load(_eight(context, builder, kind[2], places_, at_, _INTS), align=4)
        corner = builder.add(stride_, ir.Constant(stride_.type, 1))
        starts = [
            builder.sub(builder.sext(builder.extract_element(pixel, ir.Constant(_INT, k)), stride_.type), corner)
            for k in range(EIGHT)
        ]
        total = None
        for weight in down:
            part = builder.fmul(_row(builder, data, starts, across), weight)
            total = part if total is None else builder.fadd(total, part)
            starts = [builder.add(start, stride_) for start in starts]
        builder.store(total, _eight(context, builder, kind[5], out_, at_, _FLOATS), align=4)
        return context.get_dummy_value()

    return signature, generate
