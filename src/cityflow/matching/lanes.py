"""Sixteen neighbouring numbers at once, for kernels of semi-global matching: LLVM's vectors, as numba finds them by itself in simple loops only.

Every function works on 16 consecutive elements of one-dimensional arrays from an index on; nothing checks bounds. LLVM translates the vectors for
the processor at hand, whatever its width.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

LANES = 16
CENSUS_ROWS = 3
CENSUS_COLS = 4
"""Reach of the census window: 7 x 9 pixels, the largest whose comparisons fit in 64 bits."""

_BYTE, _SHORT, _INT, _LONG = (ir.IntType(n) for n in (8, 16, 32, 64))
_BYTES, _SHORTS, _LONGS = (ir.VectorType(t, LANES) for t in (_BYTE, _SHORT, _LONG))


def _place(context: Any, builder: Any, kind: Any, array: Any, index: Any, vector: Any) -> Any:
    at = builder.gep(context.make_array(kind)(context, builder, array).data, [index])
    return builder.bitcast(at, vector.as_pointer())


def _load(context: Any, builder: Any, kind: Any, array: Any, index: Any, vector: Any) -> Any:
    return builder.load(_place(context, builder, kind, array, index, vector), align=1)


def _store(context: Any, builder: Any, value: Any, kind: Any, array: Any, index: Any) -> None:
    builder.store(value, _place(context, builder, kind, array, index, value.type), align=1)


def _everywhere(builder: Any, value: Any) -> Any:
    vector = ir.VectorType(value.type, LANES)
    first = builder.insert_element(ir.Constant(vector, ir.Undefined), value, ir.Constant(_INT, 0))
    return builder.shuffle_vector(
        first, ir.Constant(vector, ir.Undefined), ir.Constant(ir.VectorType(_INT, LANES), [0] * LANES)
    )


def _less(builder: Any, a: Any, b: Any) -> Any:
    return builder.select(builder.icmp_unsigned("<", a, b), a, b)


def _least(builder: Any, vector: Any) -> Any:
    kind = ir.FunctionType(_SHORT, [_SHORTS])
    return builder.call(
        cgutils.get_or_insert_function(builder.module, kind, "llvm.vector.reduce.umin.v16i16"), [vector]
    )


@intrinsic
def census_bits(typing, image, stride, at, out, to):  # type: ignore[no-untyped-def]
    """out[to …] = which pixels of the census window are darker than its centre, for centres image[at …]; `stride`: pixels of a row."""
    signature = types.void(image, types.intp, types.intp, out, types.intp)

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        image_, stride_, at_, out_, to_ = args
        kind = signature.args
        centre = _load(context, builder, kind[0], image_, at_, _BYTES)
        window = [
            (i, j) for i in range(-CENSUS_ROWS, CENSUS_ROWS + 1) for j in range(-CENSUS_COLS, CENSUS_COLS + 1) if i or j
        ]
        total = None
        for byte in range(0, len(window), 8):
            found = ir.Constant(_BYTES, [0] * LANES)
            for bit, (i, j) in enumerate(window[byte : byte + 8]):
                row = builder.add(at_, builder.mul(stride_, ir.Constant(_LONG, i)))
                other = _load(context, builder, kind[0], image_, builder.add(row, ir.Constant(_LONG, j)), _BYTES)
                dark = builder.sext(builder.icmp_unsigned("<", other, centre), _BYTES)
                found = builder.or_(found, builder.and_(dark, ir.Constant(_BYTES, [1 << bit] * LANES)))
            part = builder.shl(builder.zext(found, _LONGS), ir.Constant(_LONGS, [byte] * LANES))
            total = part if total is None else builder.or_(total, part)
        _store(context, builder, total, kind[3], out_, to_)
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def unlike_bits(typing, own, census, at, cost, to):  # type: ignore[no-untyped-def]
    """cost[to …] = number of bits (uint8) that differ between `own` and census[at …] (uint64)."""
    signature = types.void(types.uint64, census, types.intp, cost, types.intp)

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        own_, census_, at_, cost_, to_ = args
        kind = signature.args
        unlike = builder.xor(_load(context, builder, kind[1], census_, at_, _LONGS), _everywhere(builder, own_))
        count = cgutils.get_or_insert_function(builder.module, ir.FunctionType(_LONGS, [_LONGS]), "llvm.ctpop.v16i64")
        _store(context, builder, builder.trunc(builder.call(count, [unlike]), _BYTES), kind[3], cost_, to_)
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def path_step(typing, before, after, cost, total, at, steps, first):  # type: ignore[no-untyped-def]
    """One step of a path: after[a …] = cost[t …] + min(before[b …], before[b ± 1 …] + small, most) - least, added to total[t …].

    `at` is (b, a, t), `steps` (least, small, most), uint16; `first` sets the total instead. Returns the least of after[a …], uint16.
    """
    signature = types.uint16(
        before, after, cost, total, types.UniTuple(types.intp, 3), types.UniTuple(types.uint16, 3), types.boolean
    )

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        before_, after_, cost_, total_, at_, steps_, first_ = args
        kind, one = signature.args, ir.Constant(_LONG, 1)
        b, a, t = (builder.extract_value(at_, n) for n in range(3))
        least, small, most = (_everywhere(builder, builder.extract_value(steps_, n)) for n in range(3))
        below = _load(context, builder, kind[0], before_, builder.sub(b, one), _SHORTS)
        above = _load(context, builder, kind[0], before_, builder.add(b, one), _SHORTS)
        value = builder.add(_less(builder, below, above), small)
        value = _less(builder, value, _load(context, builder, kind[0], before_, b, _SHORTS))
        value = builder.sub(_less(builder, value, most), least)
        value = builder.add(value, builder.zext(_load(context, builder, kind[2], cost_, t, _BYTES), _SHORTS))
        _store(context, builder, value, kind[1], after_, a)
        summed = _load(context, builder, kind[3], total_, t, _SHORTS)
        summed = builder.select(first_, ir.Constant(_SHORTS, [0] * LANES), summed)
        _store(context, builder, builder.add(summed, value), kind[3], total_, t)
        return _least(builder, value)

    return signature, generate


@intrinsic
def least_of(typing, total, t):  # type: ignore[no-untyped-def]
    """Least of total[t …], uint16."""
    signature = types.uint16(total, types.intp)

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        return _least(builder, _load(context, builder, signature.args[0], args[0], args[1], _SHORTS))

    return signature, generate


@intrinsic
def claim(typing, total, t, best, who, at, own):  # type: ignore[no-untyped-def]
    """Where total[t …] < best[at …]: best takes it, and who[at …] (int16) becomes `own`."""
    signature = types.void(total, types.intp, best, who, types.intp, types.int16)

    def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
        total_, t_, best_, who_, at_, own_ = args
        kind = signature.args
        value = _load(context, builder, kind[0], total_, t_, _SHORTS)
        best_so_far = _load(context, builder, kind[2], best_, at_, _SHORTS)
        holder = _load(context, builder, kind[3], who_, at_, _SHORTS)
        better = builder.icmp_unsigned("<", value, best_so_far)
        _store(context, builder, builder.select(better, value, best_so_far), kind[2], best_, at_)
        _store(context, builder, builder.select(better, _everywhere(builder, own_), holder), kind[3], who_, at_)
        return context.get_dummy_value()

    return signature, generate
