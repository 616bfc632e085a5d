"""The Maestro driver against the bytes of its user's guide, and against a simulated Maestro on a pseudo-terminal."""

from __future__ import annotations

import contextlib
import os
import select
import threading
import time
import tty
from pathlib import Path

import numpy as np
import pytest

from rigs import Rig
from tracking.mirrors import open_mirrors
from tracking.mirrors.maestro import Maestro, MaestroMirrors, crc7, maestro_mirrors, pulse_us
from tracking.mirrors.serial_port import SerialPort

RIG = Rig.load("aqua2")

DATA_BYTES = {0x04: 3, 0x07: 3, 0x09: 3, 0x10: 1, 0x13: 0, 0x21: 0}
"""Of each command, by its number without the top bit (section 5.e)."""


@pytest.fixture(autouse=True)
def _patient(monkeypatch):
    """The simulated controller is a thread, which a busy machine may let wait for longer than a real one takes."""
    monkeypatch.setitem(SerialPort.__init__.__kwdefaults__, "timeout_s", 60.0)


def long_division(message: bytes) -> int:
    """CRC-7 as section 5.d of the guide does it by hand, on strings of bits with the least significant first."""
    bits = [int(bit) for byte in message for bit in f"{byte:08b}"[::-1]] + [0] * 7
    polynomial = [1, 0, 0, 0, 1, 0, 0, 1]
    for place in range(len(bits) - 7):
        if bits[place]:
            for offset, bit in enumerate(polynomial):
                bits[place + offset] ^= bit
    return sum(bit << n for n, bit in enumerate(bits[-7:]))


class FakeMaestro(threading.Thread):
    """A Maestro behind the other end of a pseudo-terminal: both protocols, targets, speed, errors; silent if asked."""

    def __init__(self, *, device_number: int = 12, crc: bool = False, silent: bool = False, errors: int = 0):
        super().__init__(daemon=True)
        self.end, slave = os.openpty()
        tty.setraw(self.end)
        self.path = Path(os.ttyname(slave))
        self._slave = slave
        self._stop_read, self._stop_write = os.pipe()
        self._device_number, self._crc, self._silent = device_number, crc, silent
        self.errors = errors
        self.targets: dict[int, int] = {}
        self.speeds: dict[int, int] = {}
        self.accelerations: dict[int, int] = {}
        self.moving = False
        self.positions: dict[int, int] = {}
        self.received = b""

    def __enter__(self) -> FakeMaestro:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        os.write(self._stop_write, b"x")
        self.join()
        for file in (self._slave, self._stop_read, self._stop_write):
            os.close(file)
        with contextlib.suppress(OSError):
            os.close(self.end)

    def run(self) -> None:
        while True:
            ready, _, _ = select.select([self.end, self._stop_read], [], [])
            if self._stop_read in ready:
                return
            start = self._take(1)[0]
            message = bytes([start])
            if start == 0xAA:
                message += self._take(2)
            command = message[-1] & 0x7F
            message += self._take(DATA_BYTES[command])
            data = message[-DATA_BYTES[command] :] if DATA_BYTES[command] else b""
            if self._crc and self._take(1)[0] != long_division(message):
                self.errors |= 1 << 3
                continue
            if start != 0xAA or message[1] == self._device_number:
                self._obey(command, data)

    def _take(self, count: int) -> bytes:
        message = b""
        while len(message) < count:
            message += os.read(self.end, count - len(message))
        self.received += message
        return message

    def _obey(self, command: int, data: bytes) -> None:
        value = data[1] + 128 * data[2] if len(data) == 3 else 0
        if command in {0x04, 0x07, 0x09}:
            {0x04: self.targets, 0x07: self.speeds, 0x09: self.accelerations}[command][data[0]] = value
            return
        answers = {
            0x10: lambda: (self.positions or self.targets).get(data[0], 0).to_bytes(2, "little"),
            0x13: lambda: bytes([self.moving]),
            0x21: lambda: self.errors.to_bytes(2, "little"),
        }
        answer = answers[command]()
        if command == 0x21:
            # Before the answer, after which the test's own thread goes on and may set new ones.
            self.errors = 0
        if not self._silent:
            os.write(self.end, answer)


@pytest.fixture
def fake():
    with FakeMaestro() as maestro:
        yield maestro


@pytest.fixture
def maestro(fake):
    with SerialPort(fake.path) as port:
        yield Maestro(port)


def test_check_sum_of_the_guides_example():
    """Section 5.d: the packet 0x83, 0x01 gets the check sum 0x17."""
    assert crc7(bytes([0x83, 0x01])) == 0x17


def test_check_sum_is_the_remainder_of_the_long_division():
    rng = np.random.default_rng(0)
    for length in range(1, 12):
        message = rng.bytes(length)
        assert crc7(message) == long_division(message)


def test_target_of_the_guides_example(fake, maestro):
    """Section 5.e: channel 2 to 1500 us is 0x84, 0x02, 0x70, 0x2E."""
    maestro.set_target(2, 1500.0)
    assert maestro.position_us(2) == 1500.0
    assert fake.received[:4] == bytes([0x84, 0x02, 0x70, 0x2E])


def test_speed_of_the_guides_example(fake, maestro):
    """Section 5.e: a speed of 140 is 3.5 us/ms; channel 5 gets 0x87, 0x05, 0x0C, 0x01."""
    maestro.set_speed(5, 3500.0)
    maestro.errors()
    assert fake.received[:4] == bytes([0x87, 0x05, 0x0C, 0x01])
    assert fake.speeds == {5: 140}


def test_a_slow_speed_is_not_no_limit(fake, maestro):
    maestro.set_speed(0, 1.0)
    maestro.errors()
    assert fake.speeds == {0: 1}


def test_moving_and_errors(fake, maestro):
    assert not maestro.is_moving()
    fake.moving = True
    assert maestro.is_moving()
    fake.errors = 1 << 1 | 1 << 8
    assert maestro.errors() == ("serial overrun error", "script program counter error")
    assert maestro.errors() == ()


@pytest.mark.parametrize("crc", [False, True])
@pytest.mark.parametrize("device_number", [None, 12])
def test_both_protocols_with_and_without_check_sum(crc, device_number):
    with FakeMaestro(crc=crc) as fake, SerialPort(fake.path) as port:
        maestro = Maestro(port, device_number=device_number, crc=crc)
        maestro.set_target(1, 2250.0)
        maestro.set_acceleration(1, 255)
        assert maestro.position_us(1) == 2250.0
        assert maestro.errors() == ()
        assert fake.accelerations == {1: 255}


def test_the_pololu_protocol_names_the_device_and_strips_the_top_bit(fake):
    """Section 5.e: 0xAA, device number, 0x04, channel, two data bytes; 12 unless it was changed."""
    with SerialPort(fake.path) as port:
        maestro = Maestro(port, device_number=12)
        maestro.set_target(2, 1500.0)
        assert maestro.errors() == ()
    assert fake.received == bytes([0xAA, 0x0C, 0x04, 0x02, 0x70, 0x2E, 0xAA, 0x0C, 0x21])


def test_a_missing_check_sum_is_an_error_of_the_controller():
    """The controller takes the next command's first byte for the check sum."""
    with FakeMaestro(crc=True) as fake, SerialPort(fake.path) as port:
        maestro = Maestro(port)
        maestro.set_target(1, 1500.0)
        port.write(b"\x00")
        assert Maestro(port, crc=True).errors() == ("serial CRC error",)
        assert fake.targets == {}


def test_joints_become_pulses():
    """HS-5086WP: 750 to 2250 us for 155 degrees, all of which the joints of aqua2 use: from -77.5, from -32.5."""
    pan, tilt = (RIG.gaze.servos.pan, RIG.gaze.joints.pan), (RIG.gaze.servos.tilt, RIG.gaze.joints.tilt)
    for (servo, joint), low_deg in ((pan, -77.5), (tilt, -32.5)):
        assert pulse_us(servo, joint, np.radians(low_deg)) == pytest.approx(750.0)
        assert pulse_us(servo, joint, np.radians(low_deg + 155)) == pytest.approx(2250.0)
    assert pulse_us(*pan, 0.0) == 1500.0


def test_the_driver_commands_and_believes(fake):
    with maestro_mirrors(RIG, fake.path) as mirrors:
        mirrors.command(np.radians([30.0, 45.0]), 1.0)
        # 60 degrees/s from 20 / 2 + 5 ms after the command on.
        report = mirrors.report(1.265)
        np.testing.assert_allclose(np.degrees(report.q), [15.0, 15.0])
        assert not report.measured
    # Pan 30 of 155 degrees beyond the middle; tilt in the middle of -32.5 to 122.5. Quarters of a microsecond.
    assert fake.targets == {0: round(4 * (1500 + 30 * 1500 / 155)), 1: 4 * 1500}
    # 60 degrees/s are 580.6 us/s: 23 steps of 25.
    assert fake.speeds == {0: 23, 1: 23}
    assert fake.accelerations == {0: 0, 1: 0}


def test_channels_can_be_chosen(fake, maestro):
    MaestroMirrors(RIG, maestro, channels=(4, 2)).command(np.array([0.0, 0.0]), 0.0)
    assert fake.targets.keys() == {4, 2}


def test_errors_of_before_are_forgotten_and_new_ones_are_told(fake):
    fake.errors = 1 << 5
    with maestro_mirrors(RIG, fake.path) as mirrors:
        mirrors.command(np.array([0.0, 0.0]), 0.0)
        fake.errors = 1 << 4 | 1 << 5
        message = "the servo controller reports: serial protocol error, serial timeout; it has sent its servos home"
        with pytest.raises(OSError, match=message):
            mirrors.command(np.array([0.0, 0.0]), 0.1)


def test_a_target_beyond_the_travel_is_refused_and_not_sent(fake):
    with maestro_mirrors(RIG, fake.path) as mirrors:
        with pytest.raises(ValueError, match=r"expected q1 from -77\.5 to 77\.5 degrees, got 80"):
            mirrors.command(np.radians([80.0, 0.0]), 0.0)
        mirrors.command(np.radians([77.5, -32.5]), 0.0)
    assert fake.targets == {0: 9000, 1: 3000}


def test_what_is_no_controller_is_named(tmp_path):
    with pytest.raises(FileNotFoundError):
        SerialPort(tmp_path / "ttyACM9")
    (tmp_path / "file").touch()
    with pytest.raises(ValueError, match="file: expected a serial port"):
        SerialPort(tmp_path / "file")
    with (
        FakeMaestro(silent=True) as fake,
        SerialPort(fake.path, timeout_s=0.05) as port,
        pytest.raises(TimeoutError, match=r"expected an answer of 2 bytes within 0\.05 s, got 0"),
    ):
        MaestroMirrors(RIG, Maestro(port))


def test_a_controller_that_is_unplugged_is_named():
    end, slave = os.openpty()
    path = Path(os.ttyname(slave))
    with SerialPort(path) as port:
        os.close(end)
        with pytest.raises(OSError, match="the device is gone"):
            Maestro(port).errors()
    os.close(slave)


def test_a_value_that_does_not_fit_is_named(maestro):
    with pytest.raises(ValueError, match="expected a value from 0 to 16383 for channel 0, got 20000"):
        maestro.set_target(0, 5000.0)


def test_a_name_opens_the_driver(fake):
    with open_mirrors(f"maestro:{fake.path}", RIG, joints=None, live=True) as mirrors:
        mirrors.command(np.array([0.0, np.radians(45.0)]), 0.0)
    assert fake.targets == {0: 6000, 1: 6000}


def test_names_that_open_nothing_are_told(tmp_path):
    for name, options, message in [
        ("servo", {}, r"mirrors 'servo': expected none or maestro: and a serial port"),
        ("maestro:", {}, r"mirrors 'maestro:': expected none or maestro: and a serial port"),
        ("maestro:x", {"joints": tmp_path}, "expected no recorded joints beside a driver"),
        ("maestro:x", {"live": False}, "expected a live camera; a recording shows no mirror that is turned now"),
    ]:
        with pytest.raises(ValueError, match=message):
            open_mirrors(name, RIG, **({"joints": None, "live": True} | options))
    with pytest.raises(FileNotFoundError), open_mirrors(f"maestro:{tmp_path / 'no'}", RIG, joints=None, live=True):
        pass


def test_without_a_driver_the_mirrors_stand_at_zero():
    with open_mirrors("none", RIG, joints=None, live=False) as mirrors:
        assert mirrors.report(1e4).q.tolist() == [0.0, 0.0]


def silent(when: str, after_s: float = 0.05) -> Rig:
    return RIG.with_gaze(servos={"when_silent": when, "silent_after_s": after_s})


def wait_for(condition) -> None:
    deadline_s = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < deadline_s
        time.sleep(0.005)


TURNED = np.radians([30.0, 45.0])
ON_THE_WAY = {0: 6100, 1: 5900}
PARKED = {0: 6000, 1: round(4 * (1500 - 45 * 1500 / 155))}
"""q = 0: pan's middle, and 45 degrees below tilt's; quarters of a microsecond."""


@pytest.mark.parametrize(("when", "targets"), [("hold", ON_THE_WAY), ("park", PARKED)])
def test_when_the_loop_stops_sending_the_servos_are_made_safe(fake, caplog, when, targets):
    """Held where the pulses are by now, not where they were to go; the next command turns them again."""
    with maestro_mirrors(silent(when), fake.path) as mirrors:
        mirrors.command(TURNED, 1.0)
        sent = dict(fake.targets)
        fake.positions = ON_THE_WAY
        wait_for(lambda: "no command for 0.05 s: the mirrors are made safe" in caplog.text)
        wait_for(lambda: fake.targets == targets)
        mirrors.report(1.0)
        mirrors.command(TURNED, 1.1)
        assert fake.targets == sent


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
@pytest.mark.parametrize(("when", "targets"), [("hold", ON_THE_WAY), ("park", PARKED)])
def test_when_the_loop_fails_the_servos_are_made_safe_at_once(fake, when, targets, error):
    def fail():
        with maestro_mirrors(silent(when, 60.0), fake.path) as mirrors:
            mirrors.command(TURNED, 1.0)
            fake.positions = ON_THE_WAY
            raise error

    with pytest.raises(error):
        fail()
    assert fake.targets == targets


def test_a_loop_that_never_turned_anything_or_ends_well_moves_nothing(fake):
    with maestro_mirrors(silent("park"), fake.path) as mirrors:
        time.sleep(0.15)
        assert fake.targets == {}
        mirrors.command(TURNED, 1.0)
        sent = dict(fake.targets)
    assert fake.targets == sent


def test_a_controller_that_is_gone_is_told_and_the_first_error_stays(caplog):
    fake = FakeMaestro().__enter__()

    def fail():
        with maestro_mirrors(silent("park", 60.0), fake.path) as mirrors:
            mirrors.command(TURNED, 1.0)
            fake.__exit__()
            raise RuntimeError("the loop")

    with pytest.raises(RuntimeError, match="the loop"):
        fail()
    assert "the mirrors could not be made safe: " in caplog.text
