"""Names of the files that describe pages and flakes, known before a build starts."""

ENDINGS = {
    "json": ".json",
    "json-array": ".array.json",
    "phaser": ".phaser.json",
    "aseprite": ".aseprite.json",
    "css": ".css",
    "tpsheet": ".tpsheet",
}
"""File name endings by export, for exports that describe the pages of one scale."""


def animation_stem(build: str, animation: str) -> str:
    """Return the stem for files of one animation: the build's name if both have the same name."""
    if animation == build:
        return build
    return f"{build}.{animation.removeprefix(f'{build}/').replace('/', '.')}"


def flakes_file(stem: str, ending: str) -> str:
    """Return the file name of flake tracks in the format with this ending."""
    return f"{stem}.flakes.{ending}"
