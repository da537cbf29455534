"""Inputs that change while a build reads them: what a build calls fresh is what it would build.

At each of a number of instants of a build, spread over all that it does, one input is changed: for
good, or for a while and back again. Afterwards ``build`` must give, whether it finds the outputs
fresh or not, the very files that a build gives that nobody disturbs.
"""

import json
import shutil
import sys
import tempfile
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

from PIL import Image

from tests.campaign import corpus

_COUNT = 260
"""Builds of a whole campaign: twenty of each scene."""

SHORT = {"flakes": {"rate": 30, "alpha": 0.01}, "timeline": {"frames": 3}}
PACKS = {"flakes": "none", "motion_blur": "none"}


@dataclass(frozen=True, slots=True)
class Scene:
    """A recipe, and one of the files it is built from.

    Attributes:
        recipe: Its keys.
        target: The file that changes.
        change: Changes it, so that other outputs follow.
        prepare: Puts what the recipe needs into a folder.
    """

    recipe: dict[str, Any]
    target: str
    change: Callable[[Path], None]
    prepare: Callable[[Path], None] = field(default=lambda _: None)


def run(count: int | None, seed: int) -> list[str]:
    """Disturb ``count`` builds, about as many of each scene; return those called fresh that are
    not.

    ``seed`` shifts the instants.
    """
    count, faults = count or _COUNT, list[str]()
    names = list(SCENES)
    with tempfile.TemporaryDirectory(prefix="stale-") as folder:
        for k, name in enumerate(names):
            if not (instants := range(k, count, len(names))):
                continue
            repo = Repo(Path(folder) / str(k), SCENES[name])
            for number, _ in enumerate(instants):
                share = ((number + seed * 0.37) % len(instants) + 0.5) / len(instants)
                comes_back = (number + k) % 2 == 1
                if problem := repo.disturb(share, comes_back):
                    faults.append(f"{name}, {share:.3f} of a build, {comes_back=}: {problem}")
            print(f"{name}: {len(instants)} builds disturbed", flush=True)
    return faults


class Repo:
    """A folder with a recipe that is built again and again."""

    def __init__(self, folder: Path, scene: Scene) -> None:
        """Write the recipe, and count the steps of an undisturbed build."""
        self.scene, self.folder = scene, folder
        folder.mkdir()
        scene.prepare(folder)
        self.recipe = folder / "fire.yaml"
        self.recipe.write_text(json.dumps(scene.recipe), encoding="utf-8")
        self.target = folder / scene.target
        self.sound = folder / "kept"
        _copy(self.target, self.sound)
        steps = Steps(0, lambda: None)
        self.build(steps)  # imports what it needs: as many steps again afterwards
        steps = Steps(0, lambda: None)
        self.build(steps)
        self.steps = steps.taken

    def build(self, steps: "Steps") -> None:
        with steps:
            corpus.command("build", self.recipe, "--force", "-q", "--jobs", "1")

    def disturb(self, share: float, comes_back: bool) -> str | None:
        """Change the input at a share of a build; say what is wrong afterwards, if anything is."""
        _copy(self.sound, self.target)
        shutil.rmtree(self.folder / "build", ignore_errors=True)
        steps = Steps(round(share * self.steps), lambda: self.scene.change(self.target))
        later = Steps(0, lambda: None)
        if comes_back:
            later = Steps(round((share + 0.1) * self.steps), lambda: _copy(self.sound, self.target))
        with later.after(steps):
            corpus.command("build", self.recipe, "--force", "-q", "--jobs", "1")
        if comes_back:
            _copy_if_other(self.sound, self.target)
        code, said = corpus.command("build", self.recipe)
        if code:
            return f"the next build fails: {said[-300:]}"
        found = _contents(self.folder / "build")
        corpus.command("build", self.recipe, "--force", "-q")
        return None if _contents(self.folder / "build") == found else f"stale: {said[-200:]}"


class Steps:
    """Counts calls of functions of the package in all threads, and acts at one of them."""

    def __init__(self, at: int, act: Callable[[], None]) -> None:
        """Do ``act`` when ``at`` calls were made."""
        self.at, self.act, self.taken = at, act, 0
        self._next: Steps | None = None
        self._lock = threading.Lock()

    def after(self, other: "Steps") -> "Steps":
        """Count along with ``other``."""
        self._next = other
        return self

    def _seen(self, frame: FrameType, event: str, _: object) -> None:
        if event == "call" and _is_ours(frame.f_code):
            self._count()

    def _count(self) -> None:
        with self._lock:
            self.taken += 1
            is_due = self.taken == self.at
        if self._next is not None:
            self._next._count()
        if is_due:
            self.act()

    def __enter__(self) -> "Steps":
        threading.setprofile(self._seen)
        sys.setprofile(self._seen)
        return self

    def __exit__(self, *_: object) -> None:
        sys.setprofile(None)
        threading.setprofile(None)


def _is_ours(code: CodeType) -> bool:
    return "fire_atlas" in code.co_filename


def _contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.is_file()}


def _copy(source: Path, to: Path) -> None:
    """Put a file in its place as an editor does: whole, under the same name."""
    temporary = to.with_name(f".{to.name}.new")
    shutil.copyfile(source, temporary)
    temporary.replace(to)


def _copy_if_other(source: Path, to: Path) -> None:
    if source.read_bytes() != to.read_bytes():
        _copy(source, to)


# What changes, and what it is read by.


def _other_picture(path: Path) -> None:
    with Image.open(path) as image:
        size = image.size
    picture = Image.new("RGBA", size)
    picture.paste((255, 120, 10, 255), (2, 2, 9, 12))
    temporary = path.with_name(f".new{path.suffix}")
    picture.save(temporary)
    temporary.replace(path)


def _redder_picture(path: Path) -> None:
    """Change a frame, and keep its flame's place and shape."""
    with Image.open(path) as image:
        red, green, blue, alpha = image.convert("RGBA").split()
    picture = Image.merge("RGBA", (red, green.point(lambda value: value // 2), blue, alpha))
    temporary = path.with_name(f".new{path.suffix}")
    picture.save(temporary)
    temporary.replace(path)


def _other_animation(path: Path) -> None:
    frames = [Image.fromarray(frame) for frame in reversed(corpus.flames(3))]
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=50)


def _replaced(old: str, new: str) -> Callable[[Path], None]:
    """Return what changes a word of a text file in place."""

    def change(path: Path) -> None:
        path.write_text(path.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")

    return change


def _clip(count: int) -> Callable[[Path], None]:
    return lambda folder: corpus.write_clip(folder / "clip", count)


def _animation(name: str) -> Callable[[Path], None]:
    def prepare(folder: Path) -> None:
        frames = [Image.fromarray(frame) for frame in corpus.flames(3)]
        frames[0].save(folder / name, save_all=True, append_images=frames[1:], duration=50)

    return prepare


def _video(folder: Path) -> None:
    (folder / "films").mkdir()
    corpus.write_videos(folder / "films")
    other = folder / "films" / "other"
    other.write_bytes((folder / "films" / "film.webm").read_bytes())


def _other_video(path: Path) -> None:
    _copy(path.with_name("film.mov"), path)


def _profile(folder: Path) -> None:
    corpus.write_profile(folder)


def _sheet(folder: Path) -> None:
    Image.fromarray(corpus.flames(1)[0]).save(folder / "sheet.png")


def _with(name: str, text: str, first: Callable[[Path], None]) -> Callable[[Path], None]:
    """Return what puts a text file beside what ``first`` puts there."""

    def prepare(folder: Path) -> None:
        first(folder)
        (folder / name).write_text(text, encoding="utf-8")

    return prepare


GENERATED = {"kind": "profile", "slices": 2, "particles": 8, "height": 24}
MEMBER = json.dumps({"source": {"path": "clip"}, "seed": 1, **SHORT})
SCENES: dict[str, Scene] = {
    "frames": Scene(
        {"source": {"path": "clip"}, **SHORT},
        "clip/0001.png", _other_picture, _clip(3),
    ),
    "sprites": Scene(
        {"source": {"kind": "sprites", "path": "clip"}},
        "clip/0001.png", _other_picture, _clip(3),
    ),
    "sheet": Scene(
        {"source": {"path": "sheet.png", "grid": {"columns": 2, "rows": 1}}, **PACKS},
        "sheet.png", _other_picture, _sheet,
    ),
    "gif": Scene(
        {"source": {"path": "a.gif"}, **SHORT},
        "a.gif", _other_animation, _animation("a.gif"),
    ),
    "apng": Scene(
        {"source": {"path": "a.png"}, **SHORT},
        "a.png", _other_animation, _animation("a.png"),
    ),
    "video": Scene(
        {"source": {"path": "films/film.avi"}, **SHORT},
        "films/film.avi", _other_video, _video,
    ),
    "profile": Scene(
        {"source": {**GENERATED, "path": "fire.profile.json"}, "timeline": {"frames": 4}, **PACKS},
        "fire.profile.json", _replaced('"rise": ', '"rise": 1'), _profile,
    ),
    "clip of a profile": Scene(
        {"source": {**GENERATED, "path": "clip"}, "timeline": {"frames": 4}, **PACKS},
        "clip/0004.png", _redder_picture, _clip(10),
    ),
    "texture": Scene(
        {"source": {"kind": "silk", "height": 24, "width": 20, "texture": {"path": "clip"}},
         "timeline": {"frames": 3}, **PACKS},
        "clip/0003.png", _other_picture, _clip(12),
    ),
    "member": Scene(
        {"atlas": {"members": ["torch.yaml"]}}, "torch.yaml", _replaced('"seed": 1', '"seed": 2'),
        _with("torch.yaml", MEMBER, _clip(3)),
    ),
    "extends": Scene(
        {"extends": "./base.yaml"}, "base.yaml", _replaced('"seed": 1', '"seed": 2'),
        _with("base.yaml", MEMBER, _clip(3)),
    ),
    "frame of a member": Scene(
        {"atlas": {"members": ["torch.yaml"]}}, "clip/0001.png", _other_picture,
        _with("torch.yaml", MEMBER, _clip(3)),
    ),
    "template": Scene(
        {"source": {"path": "clip"}, **PACKS,
         "exports": [{"template": "list.j2", "to": "{{ name }}.txt"}]},
        "list.j2", _replaced("one", "two"), _with("list.j2", "one {{ name }}", _clip(2)),
    ),
}  # fmt: skip
