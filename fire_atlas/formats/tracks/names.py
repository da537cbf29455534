"""What files of tracks and of light are called, beside the atlas whose animations they are of."""


def stem_of(build: str, animation: str) -> str:
    """File stem of what belongs to one animation of a build: the build's own where it is alone."""
    if animation == build:
        return build
    return f"{build}.{animation.removeprefix(f'{build}/').replace('/', '.')}"


def flakes_file(stem: str, ending: str) -> str:
    """Name of the flake tracks of a stem in the format with that ending."""
    return f"{stem}.flakes.{ending}"
