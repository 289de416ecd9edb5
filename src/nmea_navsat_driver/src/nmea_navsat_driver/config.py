"""Parameters of nmea_serial_driver."""

from __future__ import annotations

from dataclasses import dataclass

from sara_common.config import ConfigError, fault, is_whole, number_faults

EPE = ('epe_quality1', 'epe_quality2', 'epe_quality4', 'epe_quality5', 'epe_quality9')


@dataclass(frozen=True)
class DriverConfig:
    """`port`, `baud`: the receiver's. `frame_id`: of the antenna. `time_ref_source`: whose time it is; '' for the
    frame. `epe_qualityN`: standard deviation (m, at an HDOP of 1) of fixes of the quality N in GGA, from a receiver
    that does not tell its own by GST: 1 autonomous, 2 differential, 4 RTK, 5 RTK float, 9 SBAS. Raises ConfigError with
    every fault.
    """

    port: str = '/dev/ttyUSB0'
    baud: int = 4800
    frame_id: str = 'gps'
    time_ref_source: str = ''
    epe_quality1: float = 4.0
    epe_quality2: float = 3.0
    epe_quality4: float = 0.02
    epe_quality5: float = 4.0
    epe_quality9: float = 3.0

    def __post_init__(self) -> None:
        faults = number_faults(self, above_0=EPE)
        for name in ('port', 'frame_id'):
            if not isinstance(getattr(self, name), str) or not getattr(self, name):
                faults.append(fault(self, name, 'is a name'))
        if not isinstance(self.time_ref_source, str):
            faults.append(fault(self, 'time_ref_source', 'is a name'))
        if not is_whole(self.baud, 1):
            faults.append(fault(self, 'baud', 'are whole numbers of 1 or more'))
        if faults:
            raise ConfigError(faults)


def prefixed(frame_id: str, prefix: object) -> str:
    """The frame of a robot that is told apart by `tf_prefix`: PREFIX/FRAME; one with a slash before it is meant as it
    stands. Without leading slashes, which tf2 does not take.
    """
    prefix = str(prefix or '').strip('/')
    return f'{prefix}/{frame_id}' if prefix and not frame_id.startswith('/') else frame_id.lstrip('/')
