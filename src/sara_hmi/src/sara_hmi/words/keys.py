"""Every key that the server may send, and what it speaks of. www/words/*.json has a sentence for each."""

from __future__ import annotations

from sara_control.assist import correction
from sara_control.assist.correction import Correction
from sara_control.gate.reasons import Reason, State, sentence

STATES = tuple(f'state.{state.name}' for state in State)
REASONS = tuple(f'reason.{reason.name}' for reason in Reason)
HELP = tuple(f'help.{reason.name}' for reason in Reason)
ASSIST = tuple(f'assist.{one.name}' for one in Correction)
GOALS = tuple(
    f'goal.{name}'
    for name in (
        'going',
        'paused',
        'pending',
        'succeeded',
        'cancelled',
        'preempted',
        'aborted',
        'rejected',
        'lost',
        'unnamed',
    )
)
WHYS = tuple(
    f'why.{name}'
    for name in (
        'no_map',
        'off_map',
        'occupied',
        'keep_out',
        'no_plan',
        'no_command',
        'oscillation',
        'blocked',
        'no_pose',
        'unsure',
        'old_data',
        'clock',
        'not_finite',
        'transform',
        'gate',
        'no_navigation',
        'unknown',
    )
)
EVENTS = ('event.stop', 'event.reset', 'event.goal', 'event.map_saved')
ERRORS = tuple(
    f'error.{name}'
    for name in (
        # frames
        'no_frame',
        'no_such_op',
        'field_missing',
        'field_wrong',
        'rate',
        'version',
        'hello_first',
        'hello_twice',
        'faults',
        # roles and pairing
        'may_not',
        'pair_first',
        'code_wrong',
        'code_paused',
        'code_none',
        'no_network',
        # the driver
        'take_refused',
        'take_pending',
        'not_driver',
        'not_asked',
        'drive_late',
        'drive_used',
        'drive_lift',
        'drive_not_driver',
        'drive_stopped',
        'drive_unheard',
        # the robot
        'other_drives',
        'stopped',
        'no_goal',
        'not_paused',
        'not_going',
        'no_place',
        'place_known',
        'places_file',
        'no_map',
        'map_file',
        'no_edits',
        'edit_small',
        'edits_full',
        'no_edit',
        'edits_file',
        'pose_kept',
        'no_pose',
        'no_profile',
        'no_navigation',
        'no_gate',
        'no_assist',
        'no_help',
        'no_speech',
        'no_words',
        'reset_moving',
        'reset_pressed',
        'reset_command',
    )
)
ALL = (*STATES, *REASONS, *HELP, *ASSIST, *GOALS, *WHYS, *EVENTS, *ERRORS)

_SENTENCES = {
    sentence(state, reason): (state.name, reason.name if sentence(state, reason) != sentence(state, None) else '')
    for state in State
    for reason in Reason
}
_CORRECTIONS = {correction.sentence(one): one.name for one in Correction}


def gate(said: str) -> tuple[str, str]:
    """(State's name, Reason's name or "") of what the safety gate says on ~status or ~give_up; ("", "") where it is no
    sentence of its.
    """
    return _SENTENCES.get(said, ('', ''))


def assist(said: str) -> str:
    """The name of the Correction that shared control says on ~status; "" where it makes none."""
    return _CORRECTIONS.get(said, '')
