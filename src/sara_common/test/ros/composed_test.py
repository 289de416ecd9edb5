#!/usr/bin/env python3
"""Two nodes in one process take themselves for two; what one of them cannot do ends the process in words."""

import contextlib
import subprocess
import sys
import unittest

import rospy
import rostest
from std_msgs.msg import String
from std_srvs.srv import Trigger

from sara_common.config import ConfigError
from sara_common.ros.composed import nodes_of

RUN = [sys.executable, '-c', 'from sara_common.ros.composed import main; main()', '__name:=both']
TOY = {'module': 'toy_node'}
PATIENCE_S = 20.0


@contextlib.contextmanager
def composed(nodes, **words):
    """The process, with these nodes and the parameter `word` of each."""
    rospy.set_param('/both/nodes', nodes)
    for name, word in words.items():
        rospy.set_param(f'/{name}/word', word)
    process = subprocess.Popen(RUN, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        yield process
    finally:
        process.terminate()
        process.wait(PATIENCE_S)
        process.stdout.close()


def heard(topic):
    return rospy.wait_for_message(topic, String, PATIENCE_S).data


class ComposedTest(unittest.TestCase):
    def test_each_has_its_own_names_parameters_and_remappings(self):
        nodes = {'a': {**TOY, 'remap': ['out:=between']}, 'b': {**TOY, 'remap': ['in:=between']}}
        with composed(nodes, a='one', b='two') as process:
            for name, word in (('a', 'one'), ('b', 'two')):
                self.assertEqual(heard(f'/{name}/said'), f'/{name} {word}')
                self.assertEqual(heard(f'/{name}/timed'), f'/{name}')
                answer = rospy.ServiceProxy(f'/{name}/who', Trigger)()
                self.assertEqual(answer.message, f'/{name} {word}')
            out = []
            rospy.Subscriber('/out', String, lambda message: out.append(message.data))
            say = rospy.Publisher('/in', String, queue_size=10)
            end = rospy.get_time() + PATIENCE_S
            while not out and rospy.get_time() < end:
                say.publish('hello')
                rospy.sleep(0.1)
            self.assertEqual(out[:1], ['hello /a /b'])
            self.assertIsNone(process.poll())

    def test_where_one_ends_the_process_ends_and_says_why(self):
        with composed({'a': TOY, 'b': TOY}, a='one', b='stumble') as process:
            said, _ = process.communicate(timeout=PATIENCE_S)
            self.assertEqual(process.returncode, 1)
            self.assertIn('/b has ended', said)
            self.assertIn('it stumbles', said)

    def test_what_is_no_node_is_named(self):
        for wanted, fault in (
            (None, 'nodes is None'),
            ({'a': {'module': 'nowhere.at_all'}}, "nodes/a/module is 'nowhere.at_all'"),
            ({'a': {'module': 'math'}}, "nodes/a/module is 'math'"),
            ({'a': 7}, 'nodes/a/module is None'),
            ({'a': {**TOY, 'remap': {'x': 'y'}}}, "nodes/a/remap is {'x': 'y'}"),
            ({'a': {**TOY, 'remap': ['x']}}, "nodes/a/remap is ['x']"),
            ({'a': {**TOY, 'remaps': []}}, 'nodes/a/remaps is []'),
        ):
            with self.assertRaises(ConfigError) as error:
                nodes_of(wanted, '/both')
            self.assertIn(fault, str(error.exception))
        with composed({'a': {'module': 'math'}}) as process:
            said, _ = process.communicate(timeout=PATIENCE_S)
            self.assertEqual(process.returncode, 1)
            self.assertIn('/both cannot start: nodes/a/module', said)


if __name__ == '__main__':
    rospy.init_node('composed_test')
    rostest.rosrun('sara_common', 'members', ComposedTest)
