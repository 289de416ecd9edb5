"""The master may be slow: what asks it for its topics must not keep an update of the filter waiting."""

import threading
import time

from sara_localization.ros.topic_watch import TopicWatch

TOPICS = [('/odom', 'nav_msgs/Odometry')]


class SlowMaster:
    """Answers when it is told to."""

    def __init__(self):
        self.may_answer, self.asked = threading.Event(), 0

    def topics(self):
        self.asked += 1
        assert self.may_answer.wait(10.0)
        return TOPICS


def until(condition):
    end = time.monotonic() + 10.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.001)


def test_updates_go_on_while_the_master_is_slow():
    master, began = SlowMaster(), time.monotonic()
    watch = TopicWatch(master.topics, period=5.0)
    assert all(watch.published(float(update)) is None for update in range(1000))
    assert time.monotonic() - began < 5.0
    assert master.asked == 1  # one question at a time, however long its answer takes
    master.may_answer.set()
    until(lambda: watch.published(1000.0) == TOPICS)


def test_the_master_is_asked_once_in_a_period_and_after_the_clock_went_back():
    master = SlowMaster()
    master.may_answer.set()
    watch = TopicWatch(master.topics, period=5.0)
    for now, asked in ((10.0, 1), (14.9, 1), (15.0, 2), (3.0, 3), (7.0, 3)):
        watch.published(now)
        until(lambda asked=asked: master.asked == asked)
        until(lambda: not watch._asking.is_alive())  # pylint: disable=protected-access
    assert watch.published(7.0) == TOPICS
