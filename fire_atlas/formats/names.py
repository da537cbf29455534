"""Names of the files that describe a build's pages and flakes, known before any work is done."""

ENDINGS = {
    "json": ".json",
    "json-array": ".array.json",
    "phaser": ".phaser.json",
    "aseprite": ".aseprite.json",
    "css": ".css",
    "tpsheet": ".tpsheet",
}
"""Endings of the files that describe the pages of one scale, by the export that writes them."""


def animation_stem(build: str, animation: str) -> str:
    """Return the file stem of what belongs to one animation: the build's own if it has only one."""
    if animation == build:
        return build
    return f"{build}.{animation.removeprefix(f'{build}/').replace('/', '.')}"


def flakes_file(stem: str, ending: str) -> str:
    """Return the name of the flake tracks of a stem, in the format with that ending."""
    return f"{stem}.flakes.{ending}"
