"""A gaze mirror on hobby servos behind a Pololu Maestro servo controller.

Commands and answers are those of the Pololu Maestro Servo Controller User's Guide, sections 4.e (errors), 5.c (compact
and Pololu protocol), 5.d (CRC) and 5.e (serial servo commands).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from optics.kernels.arrays import FloatArray
from rigs import Joint, Rig, Servo
from tracking.mirrors.dead_man import DeadMan
from tracking.mirrors.estimate import JointEstimate, expected_latency_s, jointed_servos
from tracking.mirrors.serial_port import SerialPort
from tracking.protocols import MirrorDriver, MirrorReport

SET_TARGET = 0x84
SET_SPEED = 0x87
SET_ACCELERATION = 0x89
GET_POSITION = 0x90
GET_MOVING_STATE = 0x93
GET_ERRORS = 0xA1

POLOLU_START = 0xAA
"""First byte of the Pololu protocol; a device number and the command without its top bit follow."""

CRC_POLYNOMIAL = 0x91
"""CRC-7, least significant bit first."""

STEPS_PER_US = 4
"""Targets and positions are quarters of a microsecond."""

SPEED_STEP_US_PER_S = 25.0
"""Speeds are quarters of a microsecond in 10 ms."""

SEVEN_BITS = 0x7F
LARGEST_VALUE = 0x3FFF
"""Two data bytes of seven bits."""

ERRORS = (
    "serial signal error",
    "serial overrun error",
    "serial buffer full",
    "serial CRC error",
    "serial protocol error",
    "serial timeout",
    "script stack error",
    "script call stack error",
    "script program counter error",
)
"""Bits of the error register, from bit 0."""


def crc7(message: bytes) -> int:
    """Check sum of a message: the remainder of its division by the polynomial, least significant bit first (5.d)."""
    remainder = 0
    for byte in message:
        remainder ^= byte
        for _ in range(8):
            remainder = (remainder ^ CRC_POLYNOMIAL if remainder & 1 else remainder) >> 1
    return remainder


class Maestro:
    """The servo controller, command by command.

    Parameters
    ----------
    port : SerialPort
    device_number : int, optional
        Speaks the Pololu protocol with this device of a chain (12 unless it was changed); None: the compact protocol.
    crc : bool
        Whether the controller is set to expect a check sum.
    """

    def __init__(self, port: SerialPort, *, device_number: int | None = None, crc: bool = False):
        self._port = port
        self._device_number = device_number
        self._crc = crc

    def set_target(self, channel: int, pulse_us: float) -> None:
        """Pulse width that a channel is to go to; 0 stops its pulses."""
        self._send(SET_TARGET, channel, round(STEPS_PER_US * pulse_us))

    def set_speed(self, channel: int, speed_us_per_s: float) -> None:
        """Largest speed of a channel's pulse width, in steps of 25 us/s."""
        # 0 would be no limit at all.
        self._send(SET_SPEED, channel, max(1, round(speed_us_per_s / SPEED_STEP_US_PER_S)))

    def set_acceleration(self, channel: int, value: int) -> None:
        """Largest acceleration of a channel, 0 to 255 in the controller's own unit; 0 is no limit."""
        self._send(SET_ACCELERATION, channel, value)

    def position_us(self, channel: int) -> float:
        """Pulse width that a channel sends now; 0 when it sends none. The servo itself reports nothing."""
        self._port.write(self._packet(GET_POSITION, bytes([channel])))
        return int.from_bytes(self._port.read(2), "little") / STEPS_PER_US

    def is_moving(self) -> bool:
        """Whether a channel is still on its way at its largest speed."""
        self._port.write(self._packet(GET_MOVING_STATE))
        return self._port.read(1) != b"\x00"

    def errors(self) -> tuple[str, ...]:
        """Names of the errors since the last time they were asked for; asking clears them."""
        self._port.write(self._packet(GET_ERRORS))
        register = int.from_bytes(self._port.read(2), "little")
        return tuple(name for bit, name in enumerate(ERRORS) if register >> bit & 1)

    def _send(self, command: int, channel: int, value: int) -> None:
        if not 0 <= value <= LARGEST_VALUE:
            raise ValueError(f"expected a value from 0 to {LARGEST_VALUE} for channel {channel}, got {value}")
        self._port.write(self._packet(command, bytes([channel, value & SEVEN_BITS, value >> 7])))

    def _packet(self, command: int, data: bytes = b"") -> bytes:
        if self._device_number is None:
            message = bytes([command]) + data
        else:
            message = bytes([POLOLU_START, self._device_number, command & SEVEN_BITS]) + data
        return message + bytes([crc7(message)]) if self._crc else message


class MaestroMirrors:
    """Mirror driver over a Maestro: q becomes a pulse width, the middle of a joint's range that of the servo's pulses.

    The controller limits each channel to the speed that the rig file gives its servo, so that the estimate of where the
    joints are holds for faster servos, too. An error of the controller sends all servos home: it is looked for after
    every command.

    Parameters
    ----------
    rig : Rig
        With mirrors.
    maestro : Maestro
    channels : tuple of int
        Those of pan and tilt.

    Raises
    ------
    TimeoutError
        When no controller answers.
    """

    def __init__(self, rig: Rig, maestro: Maestro, *, channels: tuple[int, int] = (0, 1)):
        self._maestro = maestro
        self._joints = tuple(zip(channels, jointed_servos(rig), strict=True))
        self._parks = rig.require_gaze().servos.when_silent == "park"
        self._estimate = JointEstimate(rig, latency_s=expected_latency_s(rig))
        self._known_s: float | None = None
        maestro.errors()  # clears what happened before
        for channel, (servo, _) in self._joints:
            maestro.set_speed(channel, servo.speed_deg_per_s * _us_per_deg(servo))
            maestro.set_acceleration(channel, 0)

    def command(self, q: FloatArray, time_s: float) -> None:
        """Send the servos to pan and tilt, radians, shape (2,), at once; they stay there when the driver ends.

        Raises
        ------
        ValueError
            Beyond the joints' limits.
        OSError
            When the controller has met an error.
        """
        self._estimate.command(q, time_s)
        self._known_s = time_s
        for angle, (channel, (servo, joint)) in zip(q, self._joints, strict=True):
            self._maestro.set_target(channel, pulse_us(servo, joint, float(angle)))
        errors = self._maestro.errors()
        if errors:
            raise OSError(f"the servo controller reports: {', '.join(errors)}; it has sent its servos home")

    def report(self, time_s: float) -> MirrorReport:
        """Where the joints are estimated to be: by their speed and the latency that the rig file expects."""
        self._known_s = time_s
        return self._estimate.report(time_s)

    def make_safe(self) -> None:
        """Hold the servos where they are, or park them, as the rig says; those that have no pulses get none."""
        pulses = [self._maestro.position_us(channel) for channel, _ in self._joints]
        if self._known_s is None or not all(pulses):
            return
        angles = [
            _within(joint, 0.0 if self._parks else angle_of(servo, joint, pulse))
            for pulse, (_, (servo, joint)) in zip(pulses, self._joints, strict=True)
        ]
        # At the last moment that the loop has named: its next image may have been taken before now.
        self.command(np.array(angles), self._known_s)


def _within(joint: Joint, angle: float) -> float:
    return float(np.clip(angle, np.radians(joint.min_deg), np.radians(joint.max_deg)))


def angle_of(servo: Servo, joint: Joint, pulse_us: float) -> float:
    """Joint value, radians, of a pulse width: the inverse of `pulse_us`."""
    middle_deg = (joint.min_deg + joint.max_deg) / 2
    return float(np.radians(middle_deg + (pulse_us - sum(servo.pulse_us) / 2) / _us_per_deg(servo)))


def pulse_us(servo: Servo, joint: Joint, angle: float) -> float:
    """Pulse width for a joint value, radians: linear, the middles of both ranges together."""
    middle_deg = (joint.min_deg + joint.max_deg) / 2
    return sum(servo.pulse_us) / 2 + (float(np.degrees(angle)) - middle_deg) * _us_per_deg(servo)


def _us_per_deg(servo: Servo) -> float:
    shortest, longest = servo.pulse_us
    return (longest - shortest) / servo.travel_deg


@contextmanager
def maestro_mirrors(rig: Rig, path: Path) -> Iterator[MirrorDriver]:
    """Driver on a port that is closed afterwards: compact protocol, no check sum, pan on channel 0, tilt on 1.

    Where the commands end, or the block fails, it does what the rig's `[servos]` say (`when_silent`).

    Parameters
    ----------
    rig : Rig
        With mirrors.
    path : Path
        Of the controller's command port, such as ``/dev/ttyACM0``.
    """
    with SerialPort(path) as port:
        mirrors = MaestroMirrors(rig, Maestro(port))
        with DeadMan(mirrors, silent_after_s=rig.require_gaze().servos.silent_after_s) as watched:
            yield watched
