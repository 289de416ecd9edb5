"""The parameters of slam_gmapping: names and units of the C++ node; config/slam_gmapping.yaml explains them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sara_common.config import ConfigError, fault, is_whole, number_faults, range_faults
from sara_localization.config.parameters import ParameterReader
from sara_slam.graph.loops import LoopRules
from sara_slam.mapping.key_scan import RangeLimits
from sara_slam.mapping.map_output import INTERVALS, MapOutput
from sara_slam.mapping.occupancy import MOST_CELLS
from sara_slam.matching.likelihood_grid import Grain

_PARTICLES = 'there are no particles: one map is kept, as a graph of poses'
_CLIMBING = 'scans are matched by a search of the whole window, not by climbing step by step'
NO_EFFECT = {
    **dict.fromkeys(('particles', 'resampleThreshold', 'ogain', 'lsigma'), _PARTICLES),
    **dict.fromkeys(('llsamplerange', 'llsamplestep', 'lasamplerange', 'lasamplestep'), _PARTICLES),
    **dict.fromkeys(('kernelSize', 'lstep', 'astep', 'iterations'), _CLIMBING),
    'inverted_laser': 'a scanner that is upside down is known by its transform',
}
"""{parameter of the C++ node: why it has no meaning here}."""
_ABOVE_0 = ('information', 'loop_drift', 'loop_widest', 'loop_reach')
_FROM_0 = (
    *INTERVALS,
    'maxRange',
    'maxUrange',
    'minimumScore',
    'srr',
    'srt',
    'str',
    'stt',
    'linearUpdate',
    'angularUpdate',
    'scale_sigma',
    'delay_sigma',
)
_RANGES = {
    'occ_thresh': (0.0, 1.0),
    'minimum_response': (0.0, 1.0),
    'loop_response': (0.0, 1.0),
    'loop_agreement': (0.0, 1.0),
    'delta': (0.005, 1.0),
    'search_resolution': (0.005, 0.5),
    'sigma': (0.005, 1.0),
}
_WHOLE = {'throttle_scans': 1, 'lskip': 0, 'local_scans': 1, 'loop_together': 1}
"""{whole number: the least}."""


@dataclass(frozen=True)
class SlamConfig(MapOutput):
    """m, rad, s. Frames without a leading slash. Ranges of 0: the scanner's own limit."""

    base_frame: str = 'base_link'
    map_frame: str = 'map'
    odom_frame: str = 'odom'
    throttle_scans: int = 1
    map_update_interval: float = 5.0
    transform_publish_period: float = 0.05
    tf_delay: float = math.nan
    maxRange: float = 0.0  # noqa: N815 - the C++ node's name
    maxUrange: float = 0.0  # noqa: N815
    minimumScore: float = 0.0  # noqa: N815
    sigma: float = 0.06
    lskip: int = 0
    deskew: bool = True
    srr: float = 0.1
    srt: float = 0.2
    str: float = 0.1
    stt: float = 0.2
    linearUpdate: float = 0.25  # noqa: N815
    angularUpdate: float = 0.25  # noqa: N815
    temporalUpdate: float = -1.0  # noqa: N815
    xmin: float = 0.0
    ymin: float = 0.0
    xmax: float = 0.0
    ymax: float = 0.0
    delta: float = 0.05
    occ_thresh: float = 0.25
    map_file: str = ''
    state_file: str = ''

    scale_sigma: float = 0.03
    delay_sigma: float = 0.1
    search_resolution: float = 0.05
    information: float = 0.2
    minimum_response: float = 0.3
    local_scans: int = 20
    loop_closing: bool = True
    loop_drift: float = LoopRules().drift
    loop_widest: float = LoopRules().widest
    loop_reach: float = LoopRules().reach
    loop_response: float = LoopRules().response
    loop_agreement: float = LoopRules().agreement
    loop_together: int = LoopRules().together
    warnings: tuple = ()

    @property
    def limits(self) -> RangeLimits:
        """Which ranges of a scan are used."""
        return RangeLimits(self.maxUrange, self.maxRange)

    @property
    def grain(self) -> Grain:
        """Of the likelihood grids."""
        return Grain(self.search_resolution, self.sigma, self.information)

    @property
    def loop_rules(self) -> LoopRules:
        """When a loop is closed."""
        return LoopRules(
            self.loop_drift,
            self.loop_widest,
            self.loop_response,
            self.loop_agreement,
            self.loop_together,
            self.loop_reach,
            self.local_scans,
        )

    def faults(self) -> list[str]:
        """Sentences, one for each bad value."""
        found = number_faults(self, _ABOVE_0, _FROM_0) + range_faults(self, _RANGES)
        found += [
            fault(self, name, f'are whole numbers of {least} or more')
            for name, least in _WHOLE.items()
            if not is_whole(getattr(self, name), least)
        ]
        return found or self._contradictions()

    def _contradictions(self):
        found = []
        for low, high in (('xmin', 'xmax'), ('ymin', 'ymax')):
            if getattr(self, low) > getattr(self, high):
                found.append(f'{low} is {getattr(self, low):g}, allowed is at most {high}: {getattr(self, high):g}')
        if not found and (self.xmax - self.xmin) * (self.ymax - self.ymin) > MOST_CELLS * self.delta**2:
            found.append(
                f'xmin to ymax ask for more than {MOST_CELLS} cells of {self.delta:g} m: nothing holds that map'
            )
        if 0.0 < self.maxRange < self.maxUrange:
            found.append(f'maxUrange is {self.maxUrange:g}, allowed is at most maxRange: {self.maxRange:g}')
        return found + self.frame_faults()

    @classmethod
    def from_params(cls, params: dict[str, object]) -> SlamConfig:
        """From a dictionary of parameters; raises ConfigError with every fault that was found."""
        reader = ParameterReader(params)
        values = cls.read(reader)
        warnings = [
            f'{name} has no effect: {NO_EFFECT[name]}.'
            if name in NO_EFFECT
            else f'{name} is no parameter of slam_gmapping: ignored.'
            for name in sorted(reader.left)
        ]
        config = cls(warnings=tuple(warnings), **values)
        faults = reader.faults + config.faults()
        if faults:
            raise ConfigError(faults, warnings)
        return config
