"""What burns: the numbers that a fuel, its pressure and its oxygen set.

Lengths are frame heights, times seconds, mass that of a sheet of one square height.
"""

from dataclasses import dataclass, replace
from typing import Literal

from fire_atlas.generators.silk.plume import Burner

FuelName = Literal["wood", "candle", "gas"]


@dataclass(frozen=True, slots=True)
class Fuel:
    """How a flame moves and looks.

    Attributes:
        mass: Of silk, per square height.
        structural, shear, bending: Stiffness, force over length.
        damping: Of a spring, 1/s against the mass of a node.
        lift: Acceleration by heat at the base, heights/s².
        lift_height: Where lift has fallen to 1/e, against the height of the sheet.
        gravity: heights/s².
        drag: Rate at which a node takes on the speed of the air, 1/s.
        flutter: Acceleration (rms) orthogonal to the sheet at its top in still air, heights/s².
        sway: Speed (rms) of the air's own slow swaying, heights/s.
        rate: Images of the texture a second at ``speed``.
        speed: v_rms of the nodes at which the texture plays at ``rate``, heights/s.
        gas: Speed of the gas in the texture, sheet heights/s at ``rate``.
        burner: The texture's fire; its ``gas`` is set from the one above.
        ramp: sRGB colours from the coolest visible flame to the hottest.
        reach: How far along the ramp the hottest flame comes, 0..1.
        blue: Light of the blue foot of the flame, 0 for none.
        light: Of the hottest flame, before exposure.
        contrast: Exponent from heat to light.
        temperature: K of the hottest flame, for ``grading: blackbody``.
    """

    mass: float
    structural: float
    shear: float
    bending: float
    damping: float
    lift: float
    lift_height: float
    gravity: float
    drag: float
    flutter: float
    sway: float
    rate: float
    speed: float
    gas: float
    burner: Burner
    ramp: tuple[str, ...]
    reach: float
    blue: float
    light: float
    contrast: float
    temperature: float


FUELS: dict[FuelName, Fuel] = {
    "wood": Fuel(
        mass=1.0, structural=26.0, shear=9.0, bending=3.0, damping=6.0,
        lift=9.0, lift_height=0.9, gravity=1.5, drag=6.0, flutter=5.0, sway=0.10,
        rate=24.0, speed=0.28, gas=1.5,
        burner=Burner(0.0, eddies=0.5, life=0.8, width=0.75, flicker=0.5, tongue=0.14, draught=0.6),
        ramp=("#a80c00", "#ff3404", "#ff660a", "#ff8c1a", "#ffb044"), reach=1.0, blue=0.0,
        light=6.5, contrast=2.7, temperature=1750.0,
    ),
    "candle": Fuel(
        mass=1.0, structural=20.0, shear=7.0, bending=3.0, damping=8.0,
        lift=6.0, lift_height=1.2, gravity=1.0, drag=6.0, flutter=0.9, sway=0.03,
        rate=24.0, speed=0.06, gas=1.3,
        burner=Burner(0.0, eddies=0.035, life=0.72, width=0.22, flicker=0.03, tongue=0.5,
                      draught=1.7, swell=0.26),
        ramp=("#c84006", "#ff8a20", "#ffb848", "#ffe09a"), reach=1.0, blue=0.22,
        light=4.6, contrast=1.0, temperature=1900.0,
    ),
    "gas": Fuel(
        mass=1.0, structural=40.0, shear=14.0, bending=6.0, damping=6.0,
        lift=13.0, lift_height=1.2, gravity=1.0, drag=6.0, flutter=3.0, sway=0.05,
        rate=30.0, speed=0.15, gas=2.6,
        burner=Burner(0.0, eddies=0.4, life=0.8, width=0.6, flicker=0.3, tongue=0.1, draught=0.7),
        ramp=("#1430d0", "#2a6cff", "#64b0ff", "#d8f0ff"), reach=1.0, blue=0.6,
        light=2.4, contrast=1.5, temperature=2600.0,
    ),
}  # fmt: skip


def fuel_of(name: FuelName, pressure: float, oxygen: float) -> Fuel:
    """Return what burns, as the paper's controls set it.

    Pressure drives the fuel out: springs and lift grow with it, and the gas with its root. Oxygen
    sets how fast it burns: rate, heat and light; a flame that lacks it is slow and red.
    """
    fuel = FUELS[name]
    return replace(
        fuel,
        structural=fuel.structural * pressure,
        shear=fuel.shear * pressure,
        bending=fuel.bending * pressure,
        lift=fuel.lift * pressure,
        gas=fuel.gas * pressure**0.5,
        rate=fuel.rate * oxygen**0.5,
        flutter=fuel.flutter * oxygen**0.5,
        light=fuel.light * oxygen,
        reach=min(fuel.reach * oxygen**0.6, 1.0),
        temperature=fuel.temperature * oxygen**0.2,
        burner=replace(fuel.burner, life=fuel.burner.life * min(pressure**0.3, 1.15)),
    )
