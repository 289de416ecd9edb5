"""set_pose: the state of a robot that somebody has put somewhere, or why it is not believed.

robot_localization jumps to the origin when the frame is unknown; here such a pose is refused.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sara_localization.config.filter_config import FilterConfig
from sara_localization.filters.state import POSE, SIZE
from sara_localization.inputs import poses
from sara_localization.inputs.data import PoseData
from sara_localization.inputs.measurement import Frames, MissingTransform, Part

# Of whatever set_pose says nothing about: a robot that was put somewhere is at rest.
VARIANCE = 1e-6
SMALLEST_VARIANCE = 1e-9


class Refused(ValueError):
    """A sentence that says why."""


def placed(data: PoseData, now: float, config: FilterConfig, transforms: Any) -> tuple[float, np.ndarray, np.ndarray]:
    """(stamp (s), x (15,), P (15, 15)) of a robot at rest at a pose, whose stamp counts as now (s) if it is zero or
    from the future. Raises Refused.
    """
    covariance = np.array(data.covariance, dtype=float).reshape(6, 6)
    if not np.isfinite(covariance).all() or not np.isfinite([*data.position, *data.orientation]).all():
        raise Refused('set_pose holds something that is not a number: ignored')
    np.fill_diagonal(covariance, np.maximum(covariance.diagonal(), SMALLEST_VARIANCE))
    stamp = data.stamp if 0.0 < data.stamp <= now else now
    pose = PoseData(stamp, data.frame_id or config.world_frame, data.position, data.orientation, covariance)
    try:
        frames = Frames(transforms, config.world_frame, config.base_link_frame, config.two_d_mode)
        prepared, problems = poses.pose(pose, Part('set_pose', (True,) * 6), frames)
    except MissingTransform as error:
        raise Refused(f'set_pose is ignored: {error}') from error
    bad = [p.sentence for p in problems if p.kind in ('bad_orientation', 'huge_value', 'huge_variance')]
    if bad:
        raise Refused(f'set_pose is ignored: {bad[0]}')
    x, P = np.zeros(SIZE), np.eye(SIZE) * VARIANCE
    inside = [k for k, i in enumerate(prepared.indices) if i < POSE.stop]
    indices = np.array(prepared.indices)[inside]
    x[indices] = prepared.z[inside]
    P[indices[:, None], indices] = prepared.R[np.ix_(inside, inside)]
    return stamp, x, P
