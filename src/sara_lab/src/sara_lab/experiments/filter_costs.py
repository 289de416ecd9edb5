"""E4: what an update of each orientation filter costs, counted on the code that the sensor node runs."""

from contextlib import contextmanager

from sara_lowlevel.sensor import complementary, madgwick
from sara_sim.chair import STEP_S


class _Counted(float):
    """A float that counts what is done with it in `operations`."""

    operations = 0


def _counting(name):
    def operation(self, *others):
        _Counted.operations += 1
        return _Counted(getattr(float, name)(self, *others))

    return operation


for _name in ('add', 'radd', 'sub', 'rsub', 'mul', 'rmul', 'truediv', 'rtruediv'):
    setattr(_Counted, f'__{_name}__', _counting(f'__{_name}__'))


@contextmanager
def _counted_functions(module, calls):
    """Let a module's functions of math count themselves in `calls`, a list."""
    kept = {name: getattr(module, name) for name in ('atan2', 'hypot', 'sqrt') if hasattr(module, name)}
    for name, function in kept.items():
        setattr(
            module,
            name,
            lambda *values, function=function, name=name: (calls.append(name), _Counted(function(*values)))[1],
        )
    try:
        yield
    finally:
        for name, function in kept.items():
            setattr(module, name, function)


def costs() -> dict[str, tuple[int, int]]:
    """{filter: (floating-point operations, calls of atan2, hypot, sqrt) of one update}, counted on the code that the
    sensor node runs.
    """
    sample, found = [_Counted(value) for value in (0.1, -0.2, 0.3, 0.4, 0.5, 9.6)], {}
    filters = {
        'complementary': (
            complementary,
            complementary.ComplementaryFilter(0.9, STEP_S),
            lambda f: f.update(tuple(sample[3:]), tuple(sample[:3]), _Counted(STEP_S)),
        ),
        'madgwick': (
            madgwick,
            madgwick.MadgwickFilter(_Counted(0.05)),
            lambda f: f.update(tuple(sample[3:]), tuple(sample[:3]), _Counted(STEP_S)),
        ),
    }
    for name, (module, one, update) in filters.items():
        update(one)  # the first sample sets it
        if name == 'madgwick':
            one.q = tuple(map(_Counted, one.q))
        calls, _Counted.operations = [], 0
        with _counted_functions(module, calls):
            update(one)
        found[name] = (_Counted.operations, len(calls))
    return found
