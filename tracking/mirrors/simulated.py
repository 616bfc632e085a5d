"""A gaze mirror on simulated servos: what they are sent, where they are, and where a driver estimates them to be."""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from optics.kernels.arrays import FloatArray
from rigs import Rig
from tracking.mirrors.estimate import JOINTS, JointEstimate, expected_latency_s, jointed_servos
from tracking.protocols import MirrorReport
from tracking.servos import ServoBehaviour, ServoPlant


class SimulatedMirrors:
    """Mirror driver over two servo plants, which it does not look at: hobby servos report nothing.

    A frame goes like this: `true_q` at the times that its exposure needs, in order; `report`; `command`, not before
    the last `true_q`, because no command can come before the image that it answers to was exposed.

    Parameters
    ----------
    plants : pair of ServoPlant
        Pan and tilt.
    estimate : JointEstimate
    """

    def __init__(self, plants: tuple[ServoPlant, ServoPlant], estimate: JointEstimate):
        self._plants = plants
        self._estimate = estimate

    @classmethod
    def from_rig(
        cls, rig: Rig, seed: int = 0, *, checked: bool = False, estimated_latency_s: float | None = None
    ) -> Self:
        """Servos as the rig file has them.

        Where they stand at power-on, where the pulses fall on the loop's clock, and the pulses' jitter come from the
        seed. Nobody knows them: the estimate starts at q = 0.

        Parameters
        ----------
        rig : Rig
            With mirrors; `ValueError` otherwise.
        seed : int
        checked : bool
            Whether a functional check is over: the servos then stand where it ends, in the middle of their ranges, and
            the driver knows it.
        estimated_latency_s : float, optional
            What the driver takes the servos' delay to be; by default what the rig file makes of it on average, as the
            driver of real servos does. A loop whose driver is ahead of its servos swings: while the mirror turns, it
            measures the target's direction as wrong as the mirror turns in that time.
        """
        servos = jointed_servos(rig)
        rng = np.random.default_rng(seed)
        # Both channels of a controller are pulsed by one clock.
        clock = rng.uniform()
        plants = []
        for servo, joint in servos:
            phase_s = clock * servo.pulse_period_ms / 1000
            behaviour = ServoBehaviour.of(servo, joint, pulse_phase_s=phase_s)
            angle = float(rng.uniform(*behaviour.travel))
            if checked:
                angle = sum(behaviour.travel) / 2
            plants.append(ServoPlant(behaviour, angle=angle, seed=int(rng.integers(2**32))))
        latency_s = expected_latency_s(rig) if estimated_latency_s is None else estimated_latency_s
        q = [plant.angle for plant in plants] if checked else None
        return cls((plants[0], plants[1]), JointEstimate(rig, latency_s=latency_s, q=q))

    def command(self, q: ArrayLike, time_s: float) -> None:
        """Ask for pan and tilt, radians, shape (2,); `ValueError` beyond the limits or before the last `true_q`."""
        self._estimate.command(q, time_s)
        for plant, angle in zip(self._plants, np.asarray(q, dtype=np.float64), strict=True):
            plant.command(float(angle), time_s)

    def report(self, time_s: float) -> MirrorReport:
        """Where the driver estimates the joints to be: by their speed alone."""
        return self._estimate.report(time_s)

    def true_q(self, time_s: float) -> FloatArray:
        """Where the joints are, radians, shape (2,), at a time that is not before the last one asked for."""
        for plant in self._plants:
            plant.advance(time_s)
        return np.array([plant.angle for plant in self._plants])

    def snapshot(self) -> dict[str, Any]:
        """Everything that `restore` needs to go on with the same bytes, for JSON."""
        plants = {name: plant.snapshot() for name, plant in zip(JOINTS, self._plants, strict=True)}
        return {"plants": plants, "estimate": self._estimate.snapshot()}

    def restore(self, snapshot: dict[str, Any]) -> None:
        """Go back to where `snapshot` was taken, by mirrors of the same rig and seed."""
        for name, plant in zip(JOINTS, self._plants, strict=True):
            plant.restore(snapshot["plants"][name])
        self._estimate.restore(snapshot["estimate"])
