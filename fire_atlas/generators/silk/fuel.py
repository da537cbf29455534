"""Fuels (wood, candle, gas): constants of the mechanics, texture and colours of a flame.

Units: lengths are frame heights, times seconds; mass 1 is that of a sheet.
"""

from dataclasses import dataclass

from fire_atlas.recipe.silk import FuelName


@dataclass(frozen=True, slots=True)
class Burner:
    """Constants of a procedural fire texture. Units: sheet heights and images.

    Attributes:
        gas_speed: Speed of the gas halfway up, sheet heights per image.
        eddy_strength: Speed (rms) of the eddies, relative to the gas.
        flame_height: Height at which the strongest fuel has burnt out.
        width: Width of the burner, relative to that of the sheet.
        flicker: Variation of the fuel along the burner and with time, 0..1.
        tongue_width: Typical width of a tongue of flame at the burner.
        entrainment: Speed of the air drawn in towards the middle, relative to the gas.
        grain: Fine variation of the fuel along the burner and with time, 0..1.
        ragged: Variation (rms) of the height at which flames begin.
        mixing: How many times faster fuel burns at the most where air is near, less 1.
        foot_heat: Heat at the foot of a flame, as a part of what it is where the gas has burnt for
            a while.
        widening_height: Height up to which the air flows outwards instead; 0 for none.
    """

    gas_speed: float
    eddy_strength: float
    flame_height: float
    width: float
    flicker: float
    tongue_width: float
    entrainment: float
    grain: float
    ragged: float
    mixing: float
    foot_heat: float
    widening_height: float = 0.0


@dataclass(frozen=True, slots=True)
class Fuel:
    """Constants of how a flame moves and looks.

    Attributes:
        mass: Mass of a sheet, whatever its size.
        structural, shear, bending: Stiffness of the springs, force per length.
        damping: Damping of a spring per mass of a node, 1/s.
        lift: Acceleration upwards by heat at the base, heights/s².
        lift_height: Height at which the lift has fallen to 1/e, relative to the sheet's.
        gravity: Acceleration downwards, heights/s².
        drag: Rate at which a node takes on the velocity of the air, 1/s.
        flutter: Acceleration (rms) normal to the sheet at its top in still air, heights/s².
        sway: Speed (rms) of the slow horizontal oscillation of the air, heights/s.
        image_rate: Texture images per second at ``reference_speed``.
        reference_speed: v_rms of the nodes at which textures play at that rate, heights/s.
        thin_speed: v_rms at which a sheet is half as opaque as at rest, heights/s.
        variety: How unlike the sheets of an arrangement are in width and in the height of their
            bases, 0..1.
        burner: Constants of the texture.
        ramp: sRGB hex colours from the coolest visible part of the flame to the hottest.
        white_hot: sRGB hex colour of a flame with all the oxygen it can use: twice as far along the
            ramp as its end.
        blue_light: Light of the blue foot of the flame, 0 for none.
        brightness: Light of the hottest part, before exposure.
        contrast: Exponent from heat to light.
        soot: Optical depth of a dense part of the flame, which hides what is behind it.
        temperature: Temperature of the hottest part, K, for ``grading: blackbody``.
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
    image_rate: float
    reference_speed: float
    thin_speed: float
    variety: float
    burner: Burner
    ramp: tuple[str, ...]
    white_hot: str
    blue_light: float
    brightness: float
    contrast: float
    soot: float
    temperature: float


FUELS: dict[FuelName, Fuel] = {
    "wood": Fuel(
        mass=1.0, structural=26.0, shear=9.0, bending=3.0, damping=6.0,
        lift=10.0, lift_height=0.9, gravity=1.5, drag=6.0, flutter=4.6, sway=0.10,
        image_rate=24.0, reference_speed=0.28, thin_speed=0.42, variety=1.0,
        burner=Burner(gas_speed=0.0625, eddy_strength=0.34, flame_height=0.85, width=0.75,
                      flicker=0.5, tongue_width=0.14, entrainment=0.6,
                      grain=0.5, ragged=0.035, mixing=4.0, foot_heat=0.3),
        ramp=("#a80a00", "#ff2a02", "#ff5405", "#ff740e", "#ff9829"), white_hot="#ffe9c8",
        blue_light=0.0,
        brightness=10.5, contrast=2.7, soot=1.6, temperature=1750.0,
    ),
    "candle": Fuel(
        mass=1.0, structural=20.0, shear=2.5, bending=3.0, damping=8.0,
        lift=6.0, lift_height=1.2, gravity=1.0, drag=6.0, flutter=0.4, sway=0.04,
        image_rate=24.0, reference_speed=0.06, thin_speed=0.11, variety=0.0,
        burner=Burner(gas_speed=0.054, eddy_strength=0.012, flame_height=0.72, width=0.26,
                      flicker=0.03, tongue_width=0.5, entrainment=2.6,
                      grain=0.0, ragged=0.0, mixing=0.0, foot_heat=1.0,
                      widening_height=0.32),
        ramp=("#d85008", "#ff9424", "#ffcc68", "#fff0c4"), white_hot="#ffffff", blue_light=0.3,
        brightness=3.8, contrast=0.6, soot=2.0, temperature=1900.0,
    ),
    "gas": Fuel(
        mass=1.0, structural=40.0, shear=14.0, bending=6.0, damping=6.0,
        lift=14.0, lift_height=1.2, gravity=1.0, drag=6.0, flutter=2.8, sway=0.05,
        image_rate=30.0, reference_speed=0.15, thin_speed=0.36, variety=0.0,
        burner=Burner(gas_speed=0.087, eddy_strength=0.4, flame_height=0.8, width=0.6, flicker=0.3,
                      tongue_width=0.1, entrainment=0.7,
                      grain=0.2, ragged=0.0, mixing=1.0, foot_heat=1.0),
        ramp=("#1430d0", "#2a6cff", "#64b0ff", "#d8f0ff"), white_hot="#ffffff", blue_light=0.6,
        brightness=2.6, contrast=1.5, soot=1.2, temperature=2600.0,
    ),
}  # fmt: skip
