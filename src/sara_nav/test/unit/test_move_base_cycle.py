"""The watch over the control cycle: what is missed is counted and said in the peer's words, once."""

import pytest

from sara_common.planar import Pose2D
from sara_nav.goals.move_base_config import Counters
from sara_nav.move_base.cycle_monitor import CycleWatch
from sara_nav.move_base.robot_state import AHEAD, RobotState


@pytest.mark.parametrize('late, missed', [(0.05, 0), (0.074, 0), (0.08, 1), (1.0, 1)])
def test_a_cycle_more_than_half_a_period_late_is_missed(late, missed):
    watch = CycleWatch()
    assert watch.begins(10.0, 20.0, True) == ''
    text = watch.begins(10.0 + late, 20.0, True)
    assert watch.missed == missed
    assert text == missed * (
        f'Control loop missed its desired rate of 20.0000Hz... the loop actually took {late:.4f} seconds'
    )


def test_nothing_is_missed_while_nothing_is_driven_or_time_went_back():
    watch = CycleWatch()
    watch.begins(0.0, 20.0, False)
    assert watch.begins(5.0, 20.0, False) == ''
    watch.forget()
    assert watch.begins(3.0, 20.0, True) == '' and watch.missed == 0


def test_the_report_starts_anew_but_the_count_goes_on():
    watch = CycleWatch()
    for t, work in ((0.0, 0.01), (0.05, 0.03), (0.25, 0.02)):
        watch.begins(t, 20.0, True)
        watch.worked(work)
    assert watch.values() == {
        'missed_cycles': 1,
        'worst_cycle_s': '0.200',
        'mean_work_s': '0.0200',
        'longest_work_s': '0.0300',
    }
    assert watch.values() == {
        'missed_cycles': 1,
        'worst_cycle_s': '0.000',
        'mean_work_s': '0.0000',
        'longest_work_s': '0.0000',
    }


@pytest.mark.parametrize(
    ('ahead', 'age'), [(-0.5, 0.5), (-0.51, None), (0.0, 0.0), (AHEAD, 0.0), (AHEAD + 0.01, None), (60.0, None)]
)
def test_a_pose_that_is_old_or_of_another_clock_is_not_driven_on(ahead, age):
    """One from before the clock was set back stays the newest until that time comes again."""
    counters = Counters()
    found = RobotState(counters).pose_age(1000.0, Pose2D(0.0, 0.0, 0.0), 1000.0 + ahead, 0.5)
    assert found == age and counters.stale_poses == (age is None)
