"""What a program with roslibpy gets of the server at PORT, as a line of JSON: `roslibpy_client.py PORT`. Run by
clients_test.py in the environment of tools/client-packages.txt.
"""

import json
import sys
import threading

import roslibpy
from roslibpy.comm.comm import RosBridgeProtocol

PATIENCE_S = 20.0
came = {}
there = {name: threading.Event() for name in ('said', 'refused')}


def told(name):
    """Keeps the first thing that comes under that name."""

    def keep(what):
        came.setdefault(name, what)
        there[name].set()

    return keep


def refusal(call):
    """The words of an exception that a call must raise."""
    try:
        call()
    except Exception as error:  # of several kinds
        return str(error)
    return 'nothing was refused'


# roslibpy has no handler for what rosbridge says of a topic that is refused. This one keeps the words.
begin = RosBridgeProtocol.__init__


def begin_with_status(self, *args, **kwargs):
    """The original, and a handler."""
    begin(self, *args, **kwargs)
    self._message_handlers['status'] = lambda message: told('refused')(message['msg'])


RosBridgeProtocol.__init__ = begin_with_status
ros = roslibpy.Ros('127.0.0.1', int(sys.argv[1]))
ros.run(timeout=PATIENCE_S)
came['param'] = ros.get_param('/hmi_clients/answer')
came['topic_type'] = ros.get_topic_type('/hmi_clients/said')
reset = roslibpy.Service(ros, '/emergency_stop/reset', 'std_srvs/Trigger')
came['service'] = dict(reset.call(roslibpy.ServiceRequest(), timeout=PATIENCE_S))
level = roslibpy.Service(ros, '/hmi/set_logger_level', 'roscpp/SetLoggerLevel')
came['service_refused'] = refusal(lambda: level.call(roslibpy.ServiceRequest(), timeout=PATIENCE_S))
roslibpy.Topic(ros, '/hmi_clients/said', 'std_msgs/String').subscribe(told('said'))
there['said'].wait(PATIENCE_S)
stop = roslibpy.Topic(ros, '/emergency_stop', 'std_msgs/Bool')
stop.advertise()
stop.publish(roslibpy.Message({'data': True}))
touch = roslibpy.Topic(ros, '/cmd_vel/touch', 'geometry_msgs/Twist')
touch.advertise()
touch.publish(roslibpy.Message({'linear': {'x': 1.0}}))
there['refused'].wait(PATIENCE_S)
print(json.dumps({**came, 'said': dict(came['said'])}), flush=True)
ros.terminate()
