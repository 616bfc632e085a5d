"""How a servo turns: pulses at their own rhythm, a delay, a rate limit, a deadband, backlash in the gears.

Between two pulses the motor runs straight towards its goal or stands, so that everything has a closed form: a servo
remembers only its last event, and its angle at any later moment is computed from that. Many small steps and a single
large one therefore give the same bytes. `docs/explanation/servos.md` has the model and what it leaves out.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from optics.tolerance.sources import pulse_angle
from rigs import Joint, Servo


@dataclass(frozen=True, kw_only=True)
class ServoBehaviour:
    """What a servo does with its pulses; angles are joint values in radians.

    Attributes
    ----------
    travel : tuple of float
        Lowest and highest angle: what is commanded beyond ends there.
    speed : float
        rad/s, without acceleration, as the paper has it.
    deadband : float
        Change that a servo at rest ignores. A larger one is followed to its end.
    backlash : float
        Between motor and horn, from flank to flank.
    pulse_period_s, pulse_phase_s : float
        Pulses begin at phase + k period; each carries the latest command given until then. A period of 0 sends each
        command at once.
    latency_s : float
        From the beginning of a pulse to the motor's answer.
    jitter : float
        Largest error of a pulse, as an angle; uniform.
    """

    travel: tuple[float, float]
    speed: float
    deadband: float = 0.0
    backlash: float = 0.0
    pulse_period_s: float = 0.0
    pulse_phase_s: float = 0.0
    latency_s: float = 0.0
    jitter: float = 0.0

    def __post_init__(self) -> None:
        if not self.travel[0] < self.travel[1]:
            raise ValueError(f"expected travel as lowest and highest angle, got {self.travel}")
        if not self.speed > 0:
            raise ValueError(f"expected a speed above 0 rad/s, got {self.speed}")
        for name in ("deadband", "backlash", "pulse_period_s", "latency_s", "jitter"):
            if not getattr(self, name) >= 0:
                raise ValueError(f"expected {name} of at least 0, got {getattr(self, name)}")
        # Pulses that repeat a command then change nothing, and only new commands are events.
        if 2 * self.jitter > self.deadband:
            raise ValueError(
                f"expected a deadband of at least twice the jitter, got {self.deadband} and {self.jitter} rad"
            )

    @classmethod
    def of(cls, servo: Servo, joint: Joint, *, pulse_phase_s: float = 0.0) -> Self:
        """As the rig file says: the joint's limits are the travel, its middle is the middle of the pulse range."""
        return cls(
            travel=(math.radians(joint.min_deg), math.radians(joint.max_deg)),
            speed=math.radians(servo.speed_deg_per_s),
            deadband=pulse_angle(servo, servo.deadband_us),
            backlash=math.radians(servo.backlash_deg),
            pulse_period_s=servo.pulse_period_ms / 1000,
            pulse_phase_s=pulse_phase_s,
            latency_s=servo.latency_ms / 1000,
            jitter=pulse_angle(servo, servo.jitter_us),
        )

    def answer_time(self, time_s: float) -> float:
        """When the motor answers to a command given at `time_s`, seconds."""
        if self.pulse_period_s == 0:
            return time_s + self.latency_s
        pulse = math.ceil((time_s - self.pulse_phase_s) / self.pulse_period_s)
        # On a pulse, rounding may put that pulse a hair before the command.
        return max(self.pulse_phase_s + pulse * self.pulse_period_s, time_s) + self.latency_s


class ServoPlant:
    """One servo and what hangs on its horn.

    Before its first pulse it is limp and stands where it was left; the first pulse makes it run there at full speed,
    from wherever that is.

    Parameters
    ----------
    behaviour : ServoBehaviour
    angle : float
        Of motor and horn at power-on, radians, within the travel.
    time_s : float
        Of power-on.
    seed : int
        Of the jitter.
    """

    def __init__(self, behaviour: ServoBehaviour, *, angle: float, time_s: float = 0.0, seed: int = 0):
        low, high = behaviour.travel
        if not low <= angle <= high:
            raise ValueError(f"expected an angle at power-on from {low} to {high} rad, got {angle}")
        self._behaviour = behaviour
        self._seed = seed
        self._now_s = time_s
        self._commanded_s = time_s
        # The last event: since then, the motor runs from _motor towards _goal. The horn was at _horn.
        self._event_s = time_s
        self._motor = angle
        self._horn = angle
        self._goal = angle
        self._answers: deque[tuple[float, float]] = deque()

    def command(self, angle: float, time_s: float) -> None:
        """Ask for an angle, radians, from a moment on; a pulse takes the latest command before it.

        Raises
        ------
        ValueError
            For an angle that is not finite, and for a moment before the last command or before what has been advanced.
        """
        if not math.isfinite(angle):
            raise ValueError(f"expected a finite angle, got {angle}")
        earliest = max(self._now_s, self._commanded_s)
        if not time_s >= earliest:
            raise ValueError(f"expected a command from {earliest} s on, where the servo is already, got {time_s} s")
        self._commanded_s = time_s
        answer_s = self._behaviour.answer_time(time_s)
        if self._answers and self._answers[-1][0] >= answer_s:
            self._answers.pop()
        self._answers.append((answer_s, self._as_pulsed(angle, answer_s)))

    def advance(self, time_s: float) -> None:
        """Let time pass until `time_s`."""
        if not time_s >= self._now_s:
            raise ValueError(f"expected a time from {self._now_s} s on, where the servo is already, got {time_s} s")
        while self._answers and self._answers[0][0] <= time_s:
            self._answer(*self._answers.popleft())
        self._now_s = time_s

    @property
    def angle(self) -> float:
        """Where the horn is now, radians."""
        return self._horn_at(self._now_s)

    @property
    def motor_angle(self) -> float:
        """Where the motor's end of the gear train is now, radians: half the backlash from the horn at most."""
        return self._motor_at(self._now_s)

    def snapshot(self) -> dict[str, Any]:
        """Everything that `restore` needs to go on with the same bytes."""
        return {
            "now_s": self._now_s,
            "commanded_s": self._commanded_s,
            "event_s": self._event_s,
            "motor": self._motor,
            "horn": self._horn,
            "goal": self._goal,
            "answers": [list(answer) for answer in self._answers],
        }

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go back to where `snapshot` was taken."""
        self._now_s = float(snapshot["now_s"])
        self._commanded_s = float(snapshot["commanded_s"])
        self._event_s = float(snapshot["event_s"])
        self._motor = float(snapshot["motor"])
        self._horn = float(snapshot["horn"])
        self._goal = float(snapshot["goal"])
        self._answers = deque((float(time_s), float(goal)) for time_s, goal in snapshot["answers"])

    def _answer(self, time_s: float, goal: float) -> None:
        """The motor takes a new goal, or ignores it when it stands and the change is small."""
        horn, motor = self._horn_at(time_s), self._motor_at(time_s)
        at_rest = motor == self._goal
        self._event_s, self._motor, self._horn = time_s, motor, horn
        if not (at_rest and abs(goal - motor) <= self._behaviour.deadband):
            self._goal = goal

    def _motor_at(self, time_s: float) -> float:
        way = self._goal - self._motor
        turned = self._behaviour.speed * (time_s - self._event_s)
        return self._goal if abs(way) <= turned else self._motor + math.copysign(turned, way)

    def _horn_at(self, time_s: float) -> float:
        """The backlash: the horn stays until a flank of the gears takes it along."""
        half = self._behaviour.backlash / 2
        motor = self._motor_at(time_s)
        return min(max(self._horn, motor - half), motor + half)

    def _as_pulsed(self, angle: float, answer_s: float) -> float:
        low, high = self._behaviour.travel
        if self._behaviour.jitter:
            # Drawn from the pulse's own time, so that it does not matter how often a command is replaced before it.
            bits = int(np.float64(answer_s).view(np.uint64))
            angle += self._behaviour.jitter * np.random.default_rng((self._seed, bits)).uniform(-1.0, 1.0)
        return min(max(angle, low), high)
