"""The transmit queue: order, limits in number and age, and that nothing survives a discard."""

from hypothesis import given
from hypothesis import strategies as st

from canserial.adapter.transmit import TransmitQueue


def take(queue, now):
    return queue.take(lambda: now, 0.0)[0]


@given(st.lists(st.integers()), st.integers(1, 20))
def test_the_newest_are_kept_in_order_and_the_rest_is_counted(frames, limit):
    queue = TransmitQueue(limit, 1.0)
    for frame in frames:
        queue.put(frame, 0.0, queue.epoch)
    assert queue.counters['full'] == max(0, len(frames) - limit)
    taken = [take(queue, 0.0) for _ in range(len(queue))]
    assert taken == frames[-limit:]
    assert take(queue, 0.0) is None


def test_what_waited_too_long_is_not_sent():
    queue = TransmitQueue(10, 0.2)
    for frame, now in (('old', 0.0), ('older', 0.1), ('new', 0.3)):
        queue.put(frame, now, queue.epoch)
    assert take(queue, 0.45) == 'new'
    assert queue.counters == {'too_old': 2}


def test_nothing_survives_a_discard():
    queue = TransmitQueue(10, 1.0)
    epoch = queue.epoch
    queue.put('waiting', 0.0, epoch)
    queue.discard()
    queue.put('asked for before', 0.0, epoch)
    assert take(queue, 0.0) is None
    assert queue.counters == {'discarded': 2}
    queue.put('after', 0.0, queue.epoch)
    assert queue.take(lambda: 0.0, 0.0) == ('after', queue.epoch)
