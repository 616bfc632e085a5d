"""Loads of a mount as rows and as a figure."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from cad.loads.masses import GRAVITY_M_PER_S2
from cad.loads.servo_torque import SAFETY_FACTOR
from cad.loads.study import LoadStudy
from reports.figures.plotting import STYLE, save_figure
from reports.figures.tolerance import write_rows

COLOURS = {"off_balance_water": "#264653", "turning": "#2a9d8f", "flow": "#e9c46a"}
LABELS = {
    "off_balance_water": "weight off the axis",
    "turning": "turning at the servo's speed",
    "flow": "flow at the vehicle's speed",
}


def mass_rows(study: LoadStudy) -> list[dict[str, Any]]:
    """One row per part and one for the whole: grams, cubic centimetres, weight in water, centre in the body frame."""
    result = study.hydrostatics
    return [
        {
            "part": body.name,
            "mass_g": 1000 * body.mass_kg,
            "volume_cm3": 1e6 * body.volume_m3,
            "weight_in_water_n": body.weight_in_water_n(result.water_density_kg_per_m3),
            **{
                f"centre_{axis}_mm": 1000 * float(value)
                for axis, value in zip("xyz", body.centre_of_mass_m, strict=True)
            },
        }
        for body in (*result.parts, result.whole)
    ]


def torque_rows(study: LoadStudy) -> list[dict[str, Any]]:
    """One row per servo; torques in N m."""
    return [
        {
            "servo": load.joint,
            "off_balance_air_n_m": load.off_balance_air,
            "off_balance_water_n_m": load.off_balance_water,
            "turning_n_m": load.turning,
            "flow_n_m": load.flow,
            "needed_n_m": load.needed,
            "rated_n_m": load.rated,
            "margin": load.margin,
            "inertia_kg_m2": load.inertia_kg_m2,
            "time_to_speed_s": load.time_to_speed_s,
        }
        for load in study.servos
    ]


def ballast_rows(study: LoadStudy) -> list[dict[str, Any]]:
    """One row per piece of ballast that makes the mount neutral and takes its moment away."""
    return [
        {
            "material": piece.material,
            "mass_g": 1000 * piece.mass_kg,
            "volume_cm3": 1e6 * piece.volume_m3,
            **{f"{axis}_mm": 1000 * float(value) for axis, value in zip("xyz", piece.position_m, strict=True)},
        }
        for piece in study.hydrostatics.ballast
    ]


def load_summary(study: LoadStudy) -> dict[str, Any]:
    """The study as one nested record, for JSON."""
    result, frequencies = study.hydrostatics, study.frequencies
    return {
        "rig": study.rig.name,
        "water_density_kg_per_m3": result.water_density_kg_per_m3,
        "mass_kg": result.whole.mass_kg,
        "volume_m3": result.whole.volume_m3,
        "weight_in_air_n": result.weight_in_air_n,
        "weight_in_water_n": result.weight_in_water_n,
        "centre_of_mass_mm": (1000 * result.whole.centre_of_mass_m).tolist(),
        "centre_of_buoyancy_mm": (1000 * result.whole.centre_of_volume_m).tolist(),
        "centre_of_mass_travel_mm": (1000 * result.travel_m).tolist(),
        "trim_deg": None
        if result.trim is None
        else {"pitch": np.degrees(result.trim.pitch_rad).item(), "roll": np.degrees(result.trim.roll_rad).item()},
        "frequencies_hz": {"in_air": list(frequencies.in_air_hz), "in_water": list(frequencies.in_water_hz)},
        "parts": mass_rows(study),
        "ballast": ballast_rows(study),
        "servos": torque_rows(study),
        "problems": [str(problem) for problem in study.problems],
    }


def write_loads(study: LoadStudy, folder: Path) -> list[Path]:
    """Write `masses.csv`, `ballast.csv`, `torques.csv` and `torques.png` into a folder, made if there is none."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / name for name in ("masses.csv", "ballast.csv", "torques.csv", "torques.png")]
    for path, rows in zip(files, (mass_rows(study), ballast_rows(study), torque_rows(study)), strict=False):
        write_rows(path, rows)
    draw_torques(study, files[-1])
    return files


def draw_torques(study: LoadStudy, path: Path) -> None:
    """Bars of what each servo has to turn against, beside its rating and what of that should be used."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.5, 0.9 * len(study.servos) + 1.3), layout="constrained")
        axes = figure.subplots()
        left = np.zeros(len(study.servos))
        places = np.arange(len(study.servos))[::-1]
        for key, label in LABELS.items():
            values = np.array([getattr(load, key) for load in study.servos])
            axes.barh(places, values, left=left, height=0.5, color=COLOURS[key], label=label)
            left = left + values
        for place, load in zip(places, study.servos, strict=True):
            axes.plot([load.rated / SAFETY_FACTOR] * 2, place + np.array([-0.36, 0.36]), color="#e76f51", lw=2)
            axes.plot([load.rated] * 2, place + np.array([-0.36, 0.36]), color="#e76f51", lw=2, ls=":")
        axes.plot([], [], color="#e76f51", lw=2, label=f"rated / {SAFETY_FACTOR:g}")
        axes.plot([], [], color="#e76f51", lw=2, ls=":", label="rated")
        axes.set_yticks(places, [load.joint for load in study.servos])
        axes.set_xlabel("torque (N m)")
        axes.set_xlim(left=0)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.32), ncols=3, frameon=False)
        axes.set_title(f"{study.rig.name}: what the servos turn against")
        save_figure(figure, path)


def load_lines(study: LoadStudy) -> list[str]:
    """The study in sentences."""
    result = study.hydrostatics
    centre, travel = 1000 * result.whole.centre_of_mass_m, 1000 * result.travel_m
    lines = [
        f"mount: {1000 * result.whole.mass_kg:.0f} g, displaces {1e6 * result.whole.volume_m3:.0f} cm3; in water it "
        f"{'weighs' if result.weight_in_water_n >= 0 else 'lifts'} "
        f"{abs(1000 * result.weight_in_water_n / GRAVITY_M_PER_S2):.0f} g "
        f"(water of {result.water_density_kg_per_m3:.1f} kg/m3)",
        f"centre of mass at ({centre[0]:.0f}, {centre[1]:.0f}, {centre[2]:.0f}) mm; the joints move it by "
        f"({travel[0]:.1f}, {travel[1]:.1f}, {travel[2]:.1f}) mm",
    ]
    if result.trim is None:
        lines.append("trim and flow are not known: the rig has no [vehicle]")
    else:
        pitch, roll = np.degrees([result.trim.pitch_rad, result.trim.roll_rad])
        lines.append(
            f"without ballast the vehicle hangs {abs(pitch):.1f} deg bow {'up' if pitch > 0 else 'down'} and "
            f"{abs(roll):.1f} deg {'left' if roll > 0 else 'right'} side up"
        )
    for row in ballast_rows(study):
        lines.append(
            f"ballast: {row['mass_g']:.0f} g of {row['material']} ({row['volume_cm3']:.0f} cm3) at "
            f"({row['x_mm']:.0f}, {row['y_mm']:.0f}, {row['z_mm']:.0f}) mm"
        )
    first, second = study.frequencies.in_water_hz
    lines.append(f"the gimbal swings on its base at {first:.0f} and {second:.0f} Hz in water (upper estimate)")
    return lines
