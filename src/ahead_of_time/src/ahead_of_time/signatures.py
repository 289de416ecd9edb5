"""The types of a kernel's arguments as text, as dispatch.c reads them."""

from typing import Any

MOST_CLASSES = 64  # of NamedTuples in one signature: each is one ASCII character from "0" on


class UnknownType(Exception):
    """A type that dispatch.c has no letter for."""


def types_of(signature: Any) -> tuple[str, tuple[str, ...]]:
    """The types of a numba signature's arguments as dispatch.c reads them: their text and the classes of NamedTuples.
    Raises UnknownType.
    """
    classes = []
    text = ''.join(_letter(type_, classes) for type_ in signature.args)
    return text, tuple(classes)


def _letter(type_, classes):
    """The text of one type. The classes of NamedTuples are appended to `classes` where they are not there yet."""
    from numba.core import types

    if isinstance(type_, types.BaseNamedTuple):
        return '{' + _number(type_.instance_class, classes) + ''.join(_letter(t, classes) for t in type_) + '}'
    if isinstance(type_, types.BaseTuple):
        return '(' + ''.join(_letter(t, classes) for t in type_) + ')'
    if isinstance(type_, types.Array) and type_.layout in 'CA' and type_.aligned and type_.ndim < 10:
        from numba.np.numpy_support import as_dtype

        dtype = as_dtype(type_.dtype)
        if dtype.kind in 'biuf' and dtype.itemsize < 10:
            return f'a{dtype.kind}{dtype.itemsize}{type_.ndim}{type_.layout}{"w" if type_.mutable else "r"}'
    letters = {types.float64: 'f', types.int64: 'i', types.boolean: 'b', types.none: 'n'}
    if type_ not in letters:
        raise UnknownType(str(type_))
    return letters[type_]


def _number(class_, classes):
    """The place of a NamedTuple's class among the signature's, as one character."""
    name = f'{class_.__module__}.{class_.__qualname__}:{",".join(class_._fields)}'
    if name not in classes:
        classes.append(name)
    if len(classes) > MOST_CLASSES:
        raise UnknownType(f'more than {MOST_CLASSES} classes of NamedTuples')
    return chr(ord('0') + classes.index(name))
