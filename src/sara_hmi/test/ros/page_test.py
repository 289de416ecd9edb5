#!/usr/bin/env python3
"""The page in Chromium with the touch screen's real server: a finger drives until it is lifted, the tab is hidden or
Chromium is killed; stop stops, what the robot says is shown, and a place is kept.
"""

import importlib.util
import os
import pathlib
import shutil
import signal
import time
import unittest

import rospy
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid
from std_msgs.msg import Bool, String

from sara_hmi.browser.page import browsing

PATIENCE_S = 30.0
ECHO = 'sara.connection.roundTrip = sara.connection.askedAt = null; sara.connection.ask()'
MISSING = [name for name in ('chromium', 'chromedriver') if shutil.which(name) is None]
MISSING += [name for name in ('selenium',) if importlib.util.find_spec(name) is None]


def wait(condition, what):
    """Until it holds; returns what it returns."""
    end = time.monotonic() + PATIENCE_S
    while not (found := condition()):
        assert time.monotonic() < end, what
        time.sleep(0.01)
    return found


@unittest.skipIf(MISSING, f'not installed: {", ".join(MISSING)} (tools/apt-packages.txt)')
class PageTest(unittest.TestCase):
    def setUp(self):
        self.touched, self.stops = [], []
        self.ears = [
            rospy.Subscriber('/cmd_vel/touch', Twist, lambda m: self.touched.append(m.linear.x), tcp_nodelay=True),
            rospy.Subscriber('/emergency_stop', Bool, lambda m: self.stops.append(m.data), tcp_nodelay=True),
        ]
        self.status = rospy.Publisher('/safety_gate/status', String, queue_size=1, latch=True)
        self.map = rospy.Publisher('/map', OccupancyGrid, queue_size=1, latch=True)
        self.url = wait(lambda: rospy.get_param('/hmi/url', ''), 'the server does not start')

    def test_a_page_is_a_robots_screen(self):
        with browsing(self.url) as page:
            page.resize(1024, 768)
            self.drives(page)
            self.is_hidden(page)
            self.shows(page)
            self.keeps_a_place(page)
            self.stops_it(page)

    def test_a_browser_that_is_killed(self):
        with browsing(self.url) as page:
            self.press(page)
            threads = pathlib.Path(f'/proc/{page.driver.service.process.pid}/task').glob('*/children')
            children = [int(child) for thread in threads for child in thread.read_text().split()]
            self.assertTrue(children)
            for child in children:
                os.kill(child, signal.SIGKILL)
            self.ends_with_one_zero()

    def press(self, page):
        """A finger drives; it is put down anew where this machine paused, a command came late, and the page rested."""
        page.load('drive')
        page.until('sara.chair.driver === null')  # the page that was there before has let go of the controls
        x, y = page.middle('#stick')
        end = time.monotonic() + PATIENCE_S
        while True:
            self.touched.clear()
            page.touch('Start', (x, y))
            page.touch('Move', (x, y - 60.0))
            wait(lambda: len(self.touched) >= 3 or not page.js('sara.pump.isHeld'), 'no commands')
            if len(self.touched) >= 3 and page.js('sara.pump.isHeld'):
                return
            assert time.monotonic() < end, 'every command comes late'
            page.touch('End')
            self.all_is_sent(page)
            wait(lambda: self.touched[-1:] in ([], [0.0]), 'no zero')
            time.sleep(0.3)

    def all_is_sent(self, page):
        """Until the server has all that the page has sent."""
        page.driver.execute_script(ECHO)
        page.until('sara.connection.roundTrip !== null')

    def ends_with_one_zero(self):
        wait(lambda: self.touched[-1] == 0.0, 'no zero')
        time.sleep(0.3)
        self.assertEqual([v == 0.0 for v in self.touched[-2:]], [False, True], self.touched)
        self.assertTrue(0.0 < self.touched[0] < 0.4, self.touched)

    def drives(self, page):
        self.press(page)
        page.touch('End')
        self.all_is_sent(page)
        self.ends_with_one_zero()

    def is_hidden(self, page):
        self.press(page)
        other = page.cdp('Target.createTarget', url='about:blank')['targetId']
        page.until('document.visibilityState === "hidden"')
        self.ends_with_one_zero()
        page.cdp('Target.closeTarget', targetId=other)
        page.until('document.visibilityState === "visible"')
        page.touch('End')

    def shows(self, page):
        self.status.publish('The chair stands still because something is close in front.')
        page.until('document.getElementById("sentence").textContent.includes("something is close in front")')
        message = OccupancyGrid(data=[0, 100, -1, 0, 0, 0])
        message.info.width, message.info.height, message.info.resolution = 3, 2, 0.5
        message.info.origin.orientation.w = 1.0
        self.map.publish(message)
        page.load('map')
        page.until('sara.chair.image && sara.chair.image.width === 3 && sara.chair.image.height === 2')

    def keeps_a_place(self, page):
        page.driver.execute_script('sara.connection.send({op: "place", name: "window", pose: [1, 2, 0]})')
        self.all_is_sent(page)
        page.load('go')
        page.until('!!document.querySelector("[data-place=window]")')
        self.assertIn('window', pathlib.Path(rospy.get_param('/places_file')).read_text(encoding='utf-8'))

    def stops_it(self, page):
        page.touch('Start', page.middle('#stop'))
        wait(lambda: self.stops[-1:] == [True], 'no emergency stop')
        page.touch('End')
        page.until('!document.getElementById("reset").hidden')


if __name__ == '__main__':
    rospy.init_node('page_test')
    rostest.rosrun('sara_hmi', 'page', PageTest)
