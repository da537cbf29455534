"""The ready fires: what each burns, how it moves and looks. All were tuned by eye at 384 px."""

import math
from dataclasses import dataclass

from fire_atlas.generators.fluid.burners import FluidBurner
from fire_atlas.generators.fluid.combustion import Chemistry
from fire_atlas.generators.fluid.forces import Forces
from fire_atlas.recipe.fluid import FireName


@dataclass(frozen=True, slots=True)
class Look:
    """How gas is drawn.

    Attributes:
        emission: Light of a height of burning gas of temperature 1.
        absorption: Optical depth of a height of burning gas: its soot hides what is behind it.
        hollow: Part of its light that fuel lacks where it is whole: it has not caught fire yet.
        dense: Fuel from which on gas burns as brightly as it can.
        coldest, hottest: Its colour at temperatures 0 and 1, K.
        contrast: Exponent of brightness by temperature.
        extinction: Optical depth of a height of smoke 1.
        thin: Smoke below which it is drawn thinner than it is, of what the fire gives.
        albedo: Share of the light that falls on smoke which it scatters: red, green, blue.
        glow: How bright the light of the fire on its smoke is, relative to its emission.
    """

    emission: float
    absorption: float
    hollow: float = 0.9
    dense: float = 0.5
    coldest: float = 850.0
    hottest: float = 1700.0
    contrast: float = 5.5
    extinction: float = 60.0
    thin: float = 0.25
    albedo: tuple[float, float, float] = (0.32, 0.30, 0.285)
    glow: float = 2.5


@dataclass(frozen=True, slots=True)
class ReadyFire:
    """A fire as it is without further keys; what is of its size is in its radii.

    Attributes:
        radius: Of what burns, heights.
        burners: Its burners, for a radius of 1.
        chemistry, forces, look: How it burns, moves and looks.
        smoke: Value of the key ``smoke``: smoke that a whole fuel gives.
        expansion: How far gas expands while it burns, in its own volumes.
        blast: Value of the key ``blast``: how much more it does at first.
        burning: Value of the key ``burning``, s; None: always.
        settling: Time that it burns before its first frame, s.
        foot: Height of its foot over the frame's lower edge, heights.
        side: Place of its foot from the frame's left edge, widths.
        depth: Depth of the box, heights.
        thinning: Part of the frame, from its top, in which gas thins to nothing, heights.
        has_ground: Whether it burns on the ground.
    """

    radius: float
    burners: tuple[FluidBurner, ...]
    chemistry: Chemistry
    forces: Forces
    look: Look
    smoke: float = 0.0
    expansion: float = 0.2
    blast: float = 0.0
    burning: tuple[float, float] | None = None
    settling: float = 1.0
    foot: float = 0.06
    side: float = 0.5
    depth: float = 0.7
    thinning: float = 0.0
    has_ground: bool = True


def _logs() -> tuple[FluidBurner, ...]:
    """Return seven burners that lie in a spiral, the outer ones lower and smaller."""
    places = (
        (0.10, 0.00, 0.40), (0.32, 0.45, 0.30), (-0.50, 0.28, 0.36), (0.12, -0.66, 0.26),
        (0.66, -0.30, 0.30), (-0.36, -0.55, 0.34), (-0.80, -0.12, 0.24),
    )  # fmt: skip
    sizes = (0.48, 0.44, 0.42, 0.40, 0.37, 0.38, 0.33)
    return tuple(
        FluidBurner(
            at=(right, away, up), size=(size, size, 0.62 * size), speed=0.6,
            ragged=0.85, pulse=0.9, wander=0.5,
        )
        for (right, away, up), size in zip(places, sizes, strict=True)
    )  # fmt: skip


def _charge(
    count: int, reach: float, size: float, life: float, uneven: float, ragged: float, grain: float
) -> tuple[FluidBurner, ...]:
    """Return lumps of a charge, spread over a ball by the golden angle.

    Args:
        count: How many.
        reach: Farthest from the middle, radii.
        size: Half the width of one of them in the mean, radii.
        life: How long one of them gives fuel in the mean, s.
        uneven: How far their sizes and distances differ, 0..1.
        ragged, grain: As of a burner; the grain in heights.
    """
    lumps = []
    for k in range(count):
        up = 1 - 2 * (k + 0.5) / count
        level, turn = (1 - up * up) ** 0.5, 2.399963 * k
        far = reach * (1 - 0.9 * uneven * (1 - (k * 0.618034) % 1))
        # The smallest are large enough for a draft.
        wide = size * max(1 + uneven * ((k * 0.381966 + 0.3) % 1 - 0.5), 0.65)
        place = (far * level * math.cos(turn), far * level * math.sin(turn), far * up)
        lumps.append(
            FluidBurner(
                at=place, size=(wide, wide, wide), ragged=ragged, grain=grain,
                temperature=1.0 + 0.6 * ((k * 0.618034 + 0.5) % 1), pulse=0.0,
                burning=(0.0, life * (0.7 + 0.6 * ((k * 0.7548777) % 1))),
            )
        )  # fmt: skip
    return tuple(lumps)


def _muzzle() -> tuple[FluidBurner, ...]:
    """Return a jet to the right, and seven shorter ones that leave a muzzle's slots aside.

    Each is a row of lumps that become thinner, slower and more ragged away from it: a fast tip
    would roll up into a ring.
    """
    rows = [((1.0, 0.0, 0.0), 8.5, 0.9)]
    for k in range(7):
        turn = 2 * math.pi * (k + 0.27) / 7
        ahead = (0.55, 0.2, 0.82, 0.36, 0.62, 0.1, 0.78)[k]
        aside = math.sqrt(1 - ahead * ahead)
        way = (ahead, aside * math.sin(turn), aside * math.cos(turn))
        rows.append((way, (2.9, 1.8, 3.6, 2.1, 3.2, 1.5, 3.0)[k], 0.7))
    lumps = []
    for way, length, wide in rows:
        count = round(length / 0.5)
        for k in range(count):
            share = (k + 0.5) / count
            far, size = 0.2 + length * share, max(wide * (1 - 0.6 * share), 0.59)
            lumps.append(
                FluidBurner(
                    at=(way[0] * far, way[1] * far, way[2] * far), size=(size, size, size),
                    fuel=1 - 0.85 * share, temperature=1.3 - 0.4 * share, speed=12 - 11 * share,
                    direction=way, ragged=0.45 + 0.5 * share, grain=0.07, pulse=0.0, spread=0.3,
                    burning=(0.0, 0.026),
                )
            )  # fmt: skip
    return tuple(lumps)


FIRES: dict[FireName, ReadyFire] = {
    "campfire": ReadyFire(
        radius=0.2,
        burners=_logs(),
        chemistry=Chemistry(0.8, 7.0, 1.9, 3.5, 0.0, 2.5),
        forces=Forces(lift=13.0, confinement=0.5, stirring=5.5, drag=0.5),
        look=Look(emission=150.0, absorption=4.0),
        smoke=0.0,
        depth=0.55,
    ),
    "torch": ReadyFire(
        radius=0.105,
        burners=(
            FluidBurner(
                (0, 0, 0), (1.15, 1.15, 0.8), temperature=0.65, speed=0.9, ragged=1.0, grain=0.09,
                pulse=0.5, wander=0.5,
            ),
        ),
        chemistry=Chemistry(0.95, 5.0, 1.9, 4.5, 0.0, 2.5),
        forces=Forces(lift=10.0, confinement=0.8, stirring=8.0, drag=0.5),
        look=Look(emission=260.0, absorption=5.0, hollow=0.7, contrast=6.5),
        foot=0.14,
        depth=0.45,
        has_ground=False,
    ),
    "flamethrower": ReadyFire(
        radius=0.072,
        burners=(
            FluidBurner(
                (0, 0, 0), (1.6, 0.9, 0.9), temperature=0.9, speed=6.5, direction=(1, 0, 0.05),
                ragged=0.15, grain=0.16, pulse=0.3, wander=0.05, spread=0.12,
            ),
        ),
        chemistry=Chemistry(0.7, 0.4, 2.4, 1.9, 0.0, 2.5),
        forces=Forces(lift=1.0, confinement=0.8, stirring=5.0, drag=0.5),
        look=Look(
            emission=260.0, absorption=16.0, hollow=0.0, dense=0.35, contrast=5.8, extinction=22.0,
        ),
        smoke=0.03,
        expansion=4.5,
        foot=0.4,
        side=0.09,
        depth=0.7,
        thinning=0.2,
        has_ground=False,
    ),
    "explosion": ReadyFire(
        radius=0.09,
        burners=_charge(9, 1.1, 0.9, 0.05, uneven=1.0, ragged=0.9, grain=0.2),
        chemistry=Chemistry(2.5, 10.0, 1.0, 1.0, 0.0, 0.25),
        forces=Forces(lift=1.0, confinement=0.3, stirring=5.0, drag=5.0),
        look=Look(
            emission=50.0, absorption=10.0, hollow=0.0, dense=0.35, hottest=1550.0, contrast=6.5,
            extinction=125.0, albedo=(0.12, 0.115, 0.11), glow=0.8,
        ),
        smoke=1.0,
        expansion=0.0,
        blast=1.0,
        burning=(0.0, 0.05),
        settling=0.0,
        foot=0.49,
        depth=0.95,
        thinning=0.2,
        has_ground=False,
    ),
    "fireball": ReadyFire(
        radius=0.11,
        burners=_charge(8, 0.85, 0.75, 0.2, uneven=0.9, ragged=0.8, grain=0.16),
        chemistry=Chemistry(1.6, 6.0, 1.6, 1.6, 0.0, 0.4),
        forces=Forces(lift=6.0, confinement=0.7, stirring=7.0, drag=0.5),
        look=Look(
            emission=120.0, absorption=14.0, hollow=0.0, dense=0.35, hottest=1650.0, contrast=6.0,
            extinction=120.0, albedo=(0.15, 0.145, 0.14), glow=1.2,
        ),
        smoke=1.0,
        expansion=0.3,
        blast=0.35,
        burning=(0.0, 0.16),
        settling=0.0,
        foot=0.22,
        depth=0.8,
        thinning=0.4,
        has_ground=False,
    ),
    "muzzle_flash": ReadyFire(
        radius=0.095,
        burners=_muzzle(),
        chemistry=Chemistry(0.1, 3.0, 1.8, 13.0, 0.0, 5.0),
        forces=Forces(lift=0.5, confinement=0.8, stirring=60.0, drag=10.0),
        look=Look(
            emission=200.0, absorption=6.0, hollow=0.0, dense=0.6, hottest=2500.0, contrast=5.5,
            extinction=60.0, thin=0.0, albedo=(0.34, 0.325, 0.31),
        ),
        smoke=0.04,
        expansion=2.3,
        burning=(0.0, 0.03),
        settling=0.0,
        foot=0.5,
        side=0.15,
        depth=0.7,
        thinning=0.15,
        has_ground=False,
    ),
    "smoke": ReadyFire(
        radius=0.085,
        burners=(
            FluidBurner(
                (0, 0, 0.3), (1.0, 1.0, 0.6), fuel=0.0, temperature=0.7, smoke=1.0, speed=0.6,
                ragged=0.8, grain=0.06, pulse=0.4, wander=0.4,
            ),
        ),
        chemistry=Chemistry(0.3, 3.0, 0.0, 0.8, 0.0, 0.6),
        forces=Forces(lift=7.0, confinement=1.0, stirring=8.0, drag=0.3),
        look=Look(emission=0.0, absorption=0.0, extinction=80.0, thin=0.2),
        smoke=1.0,
        settling=2.2,
        depth=0.6,
        thinning=0.4,
    ),
    "steam": ReadyFire(
        radius=0.06,
        burners=(
            FluidBurner(
                (0, 0, 0), (1.0, 1.0, 0.8), fuel=0.0, temperature=0.8, smoke=1.0, speed=2.4,
                ragged=0.7, grain=0.06, pulse=0.5, wander=0.3, spread=0.12,
            ),
        ),
        chemistry=Chemistry(0.3, 3.0, 0.0, 0.6, 0.0, 1.8),
        forces=Forces(lift=4.5, confinement=1.2, stirring=9.0, drag=0.6),
        look=Look(
            emission=0.0, absorption=0.0, extinction=65.0, thin=0.08, albedo=(0.86, 0.87, 0.88),
        ),
        smoke=1.0,
        settling=1.8,
        foot=0.11,
        depth=0.6,
        thinning=0.35,
        has_ground=False,
    ),
}  # fmt: skip
