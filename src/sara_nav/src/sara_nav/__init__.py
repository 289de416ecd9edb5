"""Navigation for a differential-drive robot: map server, costmaps, planners and move_base.

Everything outside ``sara_nav.ros`` is plain Python: it gets data and a time, and returns data.
"""
