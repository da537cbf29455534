"""``watch`` builds, and builds again when something changes, until it is interrupted."""

import json
import queue
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from fire_atlas.cli import main

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX"),
]


class Watch:
    """``fire-atlas watch`` as it runs, and what it says."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self.process = process
        self._lines: queue.Queue[str] = queue.Queue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._lines.put(line)

    def hears(self, text: str, seconds: float = 30) -> list[str]:
        """Wait for a line with ``text``; return the lines until then."""
        heard, end = [], time.monotonic() + seconds
        while time.monotonic() < end:
            try:
                heard.append(self._lines.get(timeout=0.1))
            except queue.Empty:
                assert self.process.poll() is None, heard
                continue
            if text in heard[-1]:
                return heard
        raise AssertionError(f"never heard {text!r}, but {heard}")

    def is_silent(self, seconds: float) -> bool:
        time.sleep(seconds)
        return self._lines.empty()

    def settles(self) -> None:
        """Wait until nothing was said for a while: a folder may have been seen half copied."""
        while not self.is_silent(1.5):
            self.hears("")

    def rest(self) -> list[str]:
        """Return the lines that were not yet heard, once the process has ended."""
        self._reader.join(timeout=20)
        return [self._lines.get_nowait() for _ in range(self._lines.qsize())]

    def ends(self, number: signal.Signals = signal.SIGINT) -> int:
        self.process.send_signal(number)
        return self.process.wait(timeout=20)


Start = Callable[..., Watch]


@pytest.fixture
def watch(tmp_path: Path, environment: dict[str, str]) -> Iterator[Start]:
    started: list[subprocess.Popen[str]] = []

    def start(*arguments: str) -> Watch:
        process = subprocess.Popen(
            [sys.executable, "-m", "fire_atlas", "watch", *arguments],
            cwd=tmp_path, env=environment, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        started.append(process)
        return Watch(process)

    yield start
    for process in started:
        process.kill()
        process.communicate()


def test_what_changes_is_built_again(watch: Start, campfire: Path) -> None:
    campfire.with_name("base.yaml").write_text(campfire.read_text())
    campfire.write_text("extends: base.yaml\n")
    (campfire.parent / "clip" / "0005.png").rename(campfire.parent / "late.png")
    watched = watch(campfire.name)
    watched.hears("campfire.yaml: 4 files in build")
    watched.hears("watching 7 files")
    assert watched.is_silent(1.5), "its own outputs are no changes"
    campfire.with_name("base.yaml").write_text(
        campfire.with_name("base.yaml").read_text() + "seed: 4\n"
    )
    watched.hears("campfire.yaml: 4 files in build")
    (campfire.parent / "late.png").rename(campfire.parent / "clip" / "0005.png")
    watched.hears("campfire.yaml: 4 files in build")
    watched.hears("watching 8 files")
    shutil.copy(campfire.parent / "clip" / "0001.png", campfire.parent / "clip" / "0003.png")
    watched.hears("campfire.yaml: 4 files in build")
    assert watched.ends() == 0


def point(link: Path, to: Path) -> None:
    """Point a link elsewhere at once, as ``ln -sfn`` and ``mv -T`` do."""
    new = link.with_name(".new link")
    new.symlink_to(to)
    new.replace(link)


def test_links_that_are_pointed_elsewhere_are_followed(watch: Start, campfire: Path) -> None:
    """Of a recipe, of a folder of frames, of a link to that link, and of one frame."""
    folder = campfire.parent
    (folder / "clip").rename(folder / "take1")
    shutil.copytree(folder / "take1", folder / "take2")
    shutil.copy(folder / "take2" / "0001.png", folder / "take2" / "0003.png")
    (folder / "current").symlink_to("take1")
    (folder / "clip").symlink_to("current")
    campfire.rename(folder / "a recipe")
    (folder / "another").write_text((folder / "a recipe").read_text() + "seed: 4\n")
    campfire.symlink_to("a recipe")
    watched = watch(campfire.name)
    watched.hears("campfire.yaml: 4 files in build")
    watched.settles()
    point(campfire, folder / "another")
    watched.hears("campfire.yaml: 4 files in build")
    watched.settles()
    point(folder / "current", folder / "take2")
    watched.hears("campfire.yaml: 4 files in build")
    watched.settles()
    frame = folder / "take2" / "0002.png"
    (folder / "elsewhere.png").write_bytes((folder / "take1" / "0000.png").read_bytes())
    point(frame, folder / "elsewhere.png")
    watched.hears("campfire.yaml: 4 files in build")
    watched.settles()
    (folder / "elsewhere.png").write_bytes((folder / "take1" / "0004.png").read_bytes())
    watched.hears("campfire.yaml: 4 files in build")
    assert watched.ends() == 0


def test_outputs_that_were_deleted_are_built_again_at_the_next_change(
    watch: Start, campfire: Path
) -> None:
    watched = watch(campfire.name)
    watched.hears("campfire.yaml: 4 files in build")
    watched.settles()
    (campfire.parent / "build" / "campfire.png").unlink()
    campfire.touch()
    watched.hears("campfire.yaml: 4 files in build")
    assert (campfire.parent / "build" / "campfire.png").is_file()
    assert watched.ends() == 0


@pytest.mark.parametrize(("option", "said"), [("-v", "watch has ended"), ("-q", "")])
def test_ctrl_c_is_how_watch_ends_and_no_error(
    watch: Start, campfire: Path, option: str, said: str
) -> None:
    watched = watch(campfire.name, option)
    if option == "-v":
        watched.hears("watching")
    else:
        manifest = campfire.parent / "build" / "campfire.manifest.json"
        while not manifest.exists():
            time.sleep(0.1)
    assert watched.ends() == 0
    rest = "".join(watched.rest())
    assert said in rest and "error" not in rest and "Traceback" not in rest


def test_what_a_cache_has_is_taken_from_it(watch: Start, campfire: Path) -> None:
    watched = watch(campfire.name, "--cache", "cache", "-v")
    watched.hears("cache: stored")
    watched.hears("watching")
    text = campfire.read_text()
    campfire.write_text(text + "seed: 4\n")
    watched.hears("cache: stored")
    watched.hears("campfire.yaml: 4 files in build")
    campfire.write_text(text)
    watched.hears("cache: hit")
    assert watched.ends() == 0


def test_textures_are_drafts_that_a_build_encodes_again(watch: Start, campfire: Path) -> None:
    build = campfire.parent / "build"

    def quality() -> str:
        manifest = json.loads((build / "campfire.manifest.json").read_bytes())
        return str(manifest["statistics"]["gpu_quality"])

    campfire.write_text(campfire.read_text() + "atlas: {gpu: [bc7.dds]}\n")
    watched = watch(campfire.name)
    watched.hears("atlas.gpu_quality: draft")
    watched.hears("campfire.yaml: 5 files in build")
    assert quality() == "draft"
    draft = (build / "campfire.bc7.dds").read_bytes()
    assert watched.ends() == 0
    assert main(["build", str(campfire)]) == 0
    assert quality() == "final" and (build / "campfire.bc7.dds").read_bytes() != draft
    again = watch(campfire.name)
    again.hears("watching")
    assert quality() == "final", "what a build has encoded in full is up to date"
    assert again.ends() == 0


def test_a_mistake_is_reported_and_waited_out(watch: Start, campfire: Path) -> None:
    good = campfire.read_text()
    campfire.write_text(good + "zzz: 1\n")
    watched = watch(campfire.name)
    watched.hears("error: campfire.yaml:3: zzz: unknown key")
    watched.hears("watching")
    campfire.write_text(good + "maps: {motion: unity}\n")
    watched.hears("error: campfire.yaml:3: maps.motion: unity motion vectors need a flipbook")
    campfire.write_text(good.replace("path: clip", "path: later"))
    watched.hears("later: does not exist")
    (campfire.parent / "clip").rename(campfire.parent / "later")
    watched.hears("campfire.yaml: 4 files in build")
    campfire.write_text("{")
    watched.hears("error: campfire.yaml")
    campfire.write_text(good.replace("path: clip", "path: later") + "seed: 2\n")
    watched.hears("campfire.yaml: 4 files in build")
    assert watched.ends(signal.SIGTERM) == 130


def test_a_mistake_is_said_once_and_mending_it_too(watch: Start, campfire: Path) -> None:
    good = campfire.read_text()
    watched = watch(campfire.name)
    watched.hears("campfire.yaml: 4 files in build")
    watched.hears("watching")
    campfire.write_text(good + "zzz: 1\n")
    watched.hears("error: campfire.yaml:3: zzz: unknown key")
    watched.settles()
    campfire.write_text(good + "zzz: 1\n# again\n")
    assert watched.is_silent(3), "the same mistake is not said again"
    campfire.write_text(good + "yyy: 1\n")
    watched.hears("error: campfire.yaml:3: yyy: unknown key")
    campfire.write_text(good)
    heard = watched.hears("campfire.yaml: the mistake is mended")
    assert any("campfire.yaml: up to date" in line for line in heard)
    assert watched.ends() == 0


def test_a_recipe_new_in_a_watched_folder_is_built(watch: Start, campfire: Path) -> None:
    watched = watch(".", "-v")
    watched.hears("campfire.yaml: 4 files in build")
    watched.hears("watching")
    campfire.with_name("torch.yaml").write_text(campfire.read_text())
    heard = watched.hears("torch.yaml: 4 files in build")
    assert not any(line.startswith("campfire.yaml") for line in heard)
    assert watched.ends() == 0


def swap(folder: Path, other: Path) -> None:
    """Put another folder in the place of one, as a checkout does."""
    folder.rename(folder.with_name("away"))
    other.rename(folder)


def remove_and_copy(folder: Path, other: Path) -> None:
    shutil.rmtree(folder)
    shutil.copytree(other, folder)


@pytest.mark.parametrize("replace", [swap, remove_and_copy])
def test_a_folder_that_is_replaced_is_still_watched(
    watch: Start, campfire: Path, replace: Callable[[Path, Path], None]
) -> None:
    clip = campfire.parent / "clip"
    other = Path(shutil.copytree(clip, campfire.parent / "other"))
    shutil.copy(clip / "0001.png", other / "0003.png")
    watched = watch(campfire.name)
    watched.hears("campfire.yaml: 4 files in build")
    watched.hears("watching 7 files")
    watched.settles()  # it looks now
    replace(clip, other)
    watched.hears("campfire.yaml: 4 files in build")
    watched.settles()
    shutil.copy(clip / "0002.png", clip / "0004.png")
    watched.hears("campfire.yaml: 4 files in build")
    assert watched.ends() == 0


@pytest.mark.parametrize("replace", [swap, remove_and_copy])
def test_a_whole_project_that_is_replaced_is_still_watched(
    watch: Start, campfire: Path, replace: Callable[[Path, Path], None]
) -> None:
    project = campfire.parent / "project"
    project.mkdir()
    (campfire.parent / "clip").rename(project / "clip")
    recipe = campfire.rename(project / campfire.name)
    other = Path(shutil.copytree(project, campfire.parent / "other"))
    (other / recipe.name).write_text(recipe.read_text() + "seed: 3\n")
    watched = watch(f"project/{recipe.name}", "-o", "out")
    watched.hears("campfire.yaml: 4 files in out")
    watched.hears("watching 7 files")
    watched.settles()  # it looks now
    replace(project, other)
    watched.hears("campfire.yaml: 4 files in out")
    watched.settles()
    recipe.write_text(recipe.read_text() + "name: fire\n")
    watched.hears("campfire.yaml: 4 files in out")
    assert watched.ends() == 0


def test_a_folder_that_is_gone_is_waited_for(watch: Start, campfire: Path) -> None:
    clip = campfire.parent / "clip"
    watched = watch(campfire.name)
    watched.hears("watching 7 files")
    watched.settles()
    kept = Path(shutil.copytree(clip, campfire.parent / "kept"))
    shutil.copy(clip / "0001.png", kept / "0003.png")
    shutil.rmtree(clip)
    watched.hears("clip: does not exist")
    kept.rename(clip)
    watched.hears("campfire.yaml: 4 files in build")
    assert watched.ends() == 0


def test_what_is_named_wrong_is_not_waited_for(watch: Start, tmp_path: Path) -> None:
    assert watch("nowhere.yaml").process.wait(timeout=20) == 2
