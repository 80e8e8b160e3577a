"""The page of gltf-meshlet view in Chromium: what it shows, and whom it asks."""

from __future__ import annotations

import functools
import json
import re
import subprocess
import threading
from collections.abc import Callable, Iterator
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
import trimesh
from PIL import Image
from scipy import ndimage

import gltf_ext
from gltf_ext.sources.primitives import EXTENSION
from gltf_meshlet.cli import main
from gltf_meshlet.view_models import prepare
from gltf_meshlet.view_server import ViewServer
from tests.helpers import browsers, environment, processes
from tests.helpers.environment import NODE_MODULES, VECTORS
from tests.helpers.gltf_builder import Builder, glb_json, grid_mesh
from tests.helpers.instances import write_instanced
from tests.helpers.vulkan_scenes import ball

DRIVER = Path(__file__).with_name("view.mjs")
SCENE = {"dark": (0x1D, 0x21, 0x26), "light": (0xEE, 0xF0, 0xF3)}  # --scene in view.css
SHOWN = ["wait", "ready", "error"]
TWO_FRAMES = "new Promise((end) => requestAnimationFrame(() => requestAnimationFrame(end)))"
PAINTED = ["evaluate", TWO_FRAMES]


@pytest.fixture(scope="module")
def browser() -> Iterator[subprocess.Popen[str]]:
    """view.mjs with a browser for all tests."""
    environment.need_npm_package("playwright-core")
    chromium = environment.need_program("chromium", "Debian: apt install chromium")
    command = ["node", str(DRIVER), str(NODE_MODULES), chromium]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    # A page takes 8 s of processor time with Chromium's own SwiftShader, 3 s with lavapipe.
    faster = browsers.lavapipe_environment() if browsers.LAVAPIPE.is_file() else None
    with processes.running(command, text=True, env=faster, **pipes) as process:
        yield process


@pytest.fixture
def browse(browser) -> Callable[..., list[list[Any]]]:
    """Runs steps of view.mjs on pages, and checks whom they asked."""

    def run(*pages: dict[str, Any], errors: bool = False) -> list[list[Any]]:
        browser.stdin.write(json.dumps(pages) + "\n")
        browser.stdin.flush()
        answers = json.loads(browser.stdout.readline() or '{"error": "view.mjs has ended"}')
        assert "error" not in answers, answers["error"]
        for page, answer in zip(pages, answers):
            own = urlsplit(page["address"]).netloc
            asked = {urlsplit(url.removeprefix("blob:")).netloc for url in answer["requests"]}
            assert asked - {""} == {own}
            assert errors or answer["problems"] == []
        return [answer["results"] for answer in answers]

    return run


@pytest.fixture
def serve(tmp_path) -> Iterator[Callable[..., str]]:
    """Starts the server for a file; returns its address."""
    running = []

    def start(path: Path, original: Path | None = None) -> str:
        folder = tmp_path / f"work-{len(running)}"
        folder.mkdir()
        server = ViewServer(prepare(path, original, folder), folder)
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05})
        thread.start()
        running.append((server, thread))
        return server.address

    yield start
    for server, thread in running:
        server.shutdown()
        thread.join()
        server.server_close()


@pytest.fixture
def static(tmp_path) -> Iterator[Callable[[Path], str]]:
    """Serves a folder with Python's plain server, which knows no .wasm nor .glb."""
    servers = []

    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, *arguments: Any) -> None:
            pass

    def start(folder: Path) -> str:
        handler = functools.partial(Quiet, directory=str(folder))
        server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        servers.append(server)
        return f"http://127.0.0.1:{server.server_port}/"

    yield start
    for server in servers:
        server.shutdown()
        server.server_close()


@pytest.fixture
def torus(tmp_path) -> Path:
    trimesh.creation.torus(2.0, 0.7).export(tmp_path / "torus.glb")
    return tmp_path / "torus.glb"


@pytest.fixture(scope="module")
def bunny(model, tmp_path_factory) -> Path:
    """With levels."""
    environment.need_package("meshoptimizer")
    path = tmp_path_factory.mktemp("bunny") / "bunny.glb"
    gltf_ext.compress(model("bunny.glb"), path, lod=True)
    return path


def pixels(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path).convert("RGB"), np.int16)


def drawn(path: Path, scheme: str = "dark") -> np.ndarray:
    """Which pixels of the picture of a canvas are not background."""
    return (abs(pixels(path) - SCENE[scheme]) > 3).any(axis=2)


def halves(picture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Left and right, without the column in the middle of an odd width."""
    width = picture.shape[1] // 2
    return picture[:, :width], picture[:, -width:]


def colours(path: Path) -> int:
    """How many hues the picture shows."""
    hsv = np.asarray(Image.open(path).convert("HSV"))
    saturated = hsv[(hsv[..., 1] > 80) & (hsv[..., 2] > 60)]
    return int((np.bincount(saturated[:, 0] // 8, minlength=32) > 20).sum())


def blob_bytes(path: Path) -> int:
    """The bytes of the compressed primitives of a file."""
    document = glb_json(path)
    primitives = [primitive for mesh in document["meshes"] for primitive in mesh["primitives"]]
    views = {primitive["extensions"][EXTENSION]["bufferView"] for primitive in primitives}
    return sum(document["bufferViews"][view]["byteLength"] for view in views)


def test_views_of_a_model(browse, serve, torus, tmp_path):
    """Pictures that the page saves: plain, meshlets, wireframe, side by side, turned, fitted."""
    pictures = ("plain", "meshlets", "wireframe", "beside", "turned", "zoomed", "fitted", "first")
    to = {name: str(tmp_path / f"{name}.png") for name in (*pictures, "light")}
    (results,) = browse(
        {
            "address": serve(torus),
            "width": 1000,  # panes side by side
            "steps": [
                SHOWN,
                ["text", "#details"],
                ["download", "s", to["plain"]],
                ["key", "m"],
                ["download", "s", to["meshlets"]],
                ["key", "m"],
                ["key", "w"],
                ["download", "s", to["wireframe"]],
                ["key", "w"],
                ["key", "o"],
                PAINTED,
                SHOWN,
                ["text", "#details"],
                ["download", "s", to["beside"]],
                ["visible", "#label-original"],
                ["key", "o"],
                ["visible", "#label-original"],
                ["key", "ArrowLeft"],
                ["key", "ArrowLeft"],
                ["key", "Shift+ArrowUp"],
                PAINTED,
                ["download", "s", to["turned"]],
                ["key", "+"],
                ["key", "+"],
                ["key", "+"],
                PAINTED,
                ["download", "s", to["zoomed"]],
                ["key", "f"],
                PAINTED,
                ["download", "s", to["fitted"]],
                ["key", "r"],
                PAINTED,
                ["download", "s", to["first"]],
                ["key", "t"],
                ["download", "s", to["light"]],
            ],
        }
    )
    assert results[0] == "ready"
    assert results[2] == "torus.png"
    report = gltf_ext.inspect(next(tmp_path.glob("work-0/compressed.glb")))["totals"]
    for label, number in [("Triangles", "triangles"), ("Meshlets", "meshlets")]:
        assert f"{label}\t\t{report[number]:,}\n" in results[1]
    size = torus.stat().st_size
    assert f"File\t{size / 1000:.1f} kB\t" in results[1]
    assert results[1].count("Times smaller") == 1
    row = re.search(r"\nGeometry\t(.*) kB\t(.*) kB\n", results[1])
    raw, compressed = report["raw_bytes"], blob_bytes(next(tmp_path.glob("work-0/compressed.glb")))
    # The page does not count the extension's JSON.
    expected = [f"{raw / 1000:.1f}", f"{compressed / 1000:.1f}"]
    assert [*row.groups()] == expected
    assert f"Triangles\t{report['triangles']:,}\t{report['triangles']:,}\n" in results[12]
    assert all(f"\n{time}\t" in results[12] for time in ("Read", "Decode", "Build", "First frame"))
    assert (results[14], results[16]) == (True, False)

    area = {name: drawn(path).mean() for name, path in to.items() if name != "light"}
    assert 0.1 < area["plain"] < 0.6
    assert colours(to["plain"]) <= 2 and colours(to["meshlets"]) >= 10
    assert area["wireframe"] == pytest.approx(area["plain"], rel=0.1)
    assert (pixels(to["wireframe"]) != pixels(to["plain"])).mean() > 0.02
    both = drawn(to["beside"])
    left, right = halves(both)
    assert (left != right).mean() < 0.002 and left.mean() > 0.05
    assert (drawn(to["turned"]) != drawn(to["plain"])).mean() > 0.01
    assert area["zoomed"] > 1.2 * area["plain"]
    edges = drawn(to["fitted"])
    assert not (edges[0].any() or edges[-1].any() or edges[:, 0].any() or edges[:, -1].any())
    assert (pixels(to["first"]) != pixels(to["plain"])).mean() < 0.001
    assert (pixels(to["light"])[0, 0] == SCENE["light"]).all()


def test_models_with_levels_stream(browse, serve, bunny, tmp_path):
    """Sliders, colours, the frozen cut and what the page tells."""
    coarse, fine, by_level = (str(tmp_path / f"{name}.png") for name in "abc")
    slide = "pixels.value = {}; pixels.dispatchEvent(new Event('input'))"
    told = "parseFloat(/{}\\s+([\\d.,]+)/.exec(details.innerText)?.[1])"
    choose = "colour.value = '{}'; colour.dispatchEvent(new Event('change'))"
    (results,) = browse(
        {
            "address": serve(bunny),
            "steps": [
                SHOWN,
                ["evaluate", slide.format(5)],
                ["until", told.format("Error in pixels") + " > 1"],
                ["text", "#details"],
                ["evaluate", slide.format(-2)],
                ["until", told.format("Error in pixels") + " <= 0.25"],
                ["text", "#details"],
                ["download", "s", fine],
                ["evaluate", choose.format("level")],
                PAINTED,
                ["download", "s", by_level],
                ["evaluate", "freeze.click()"],
                ["evaluate", slide.format(5)],
                PAINTED,
                ["download", "s", coarse],
            ],
        }
    )
    assert results[0] == "ready"
    drawn_triangles = [
        int(re.search(r"Drawn\t\t?([\d,]+)", text)[1].replace(",", ""))
        for text in (results[3], results[6])
    ]
    assert 100 < drawn_triangles[0] < drawn_triangles[1] / 4
    assert "Pages in memory" in results[6] and "Requests" in results[6]
    assert drawn(fine).mean() > 0.1
    assert (pixels(by_level) != pixels(fine)).mean() > 0.05


def test_sliders_have_their_keys_and_files_are_read_once(browse, serve, bunny):
    """What tells whether a file has levels is not fetched again to stream it."""
    entries = "performance.getEntriesByType('resource')"
    asked = f"{entries}.filter(({{ name }}) => name.endsWith('.glb')).length"
    told = "Number(/Requests\\s+(\\d+)/.exec(details.innerText)?.[1])"
    arrow = "new KeyboardEvent('keydown', { key: 'ArrowRight', bubbles: true, cancelable: true })"
    (results,) = browse(
        {
            "address": serve(bunny),
            "steps": [
                SHOWN,
                ["until", f"{told} > 0"],
                ["evaluate", "freeze.click()"],
                PAINTED,
                ["evaluate", f"[{asked}, {told}]"],
                ["evaluate", "pixels.focus()"],
                ["key", "ArrowRight"],
                ["key", "ArrowRight"],
                ["evaluate", "Number(pixels.value)"],
                # The model turns with those that it takes.
                ["evaluate", f"[pixels, canvas].map((one) => one.dispatchEvent({arrow}))"],
            ],
        }
    )
    fetched, stated = results[4]
    assert fetched == stated
    assert results[8] == 0.5
    assert results[9] == [True, False]


def test_another_model_ends_a_stream_that_opens(browse, serve, bunny, torus):
    change = "models.dispatchEvent(new Event('change'))"  # opens it again
    # The next request gets no answer.
    stall = """
        const original = window.fetch;
        window.ended = 0;
        window.fetch = (_, { signal }) => {
          window.fetch = original;
          return new Promise((_, reject) =>
            signal.addEventListener('abort', () => {
              window.ended++;
              reject(signal.reason);
            }));
        };
    """
    (results,) = browse(
        {
            "address": serve(bunny),
            "steps": [
                SHOWN,
                ["evaluate", stall],
                ["evaluate", change],
                ["drop", [["torus.glb", str(torus)]]],
                SHOWN,
                ["evaluate", "window.ended"],
                ["visible", "#status"],
            ],
        }
    )
    assert results[4:] == ["ready", 1, False]


def test_picture_comes_back_after_a_lost_context(browse, serve, bunny, tmp_path):
    before, after = str(tmp_path / "before.png"), str(tmp_path / "after.png")
    context = "document.getElementById('canvas').getContext('webgl2')"
    at_one_pixel = "/Error in pixels\\s+(1|0\\.\\d+)\\s/.test(details.innerText)"
    (results,) = browse(
        {
            "address": serve(bunny),
            "steps": [
                SHOWN,
                ["until", at_one_pixel],
                PAINTED,
                ["download", "s", before],
                [
                    "evaluate",
                    f"(lost = {context}.getExtension('WEBGL_lose_context')).loseContext()",
                ],
                ["wait", "error"],
                ["text", "#error"],
                ["evaluate", "lost.restoreContext()"],
                ["wait", "ready"],
                ["visible", "#error"],
                PAINTED,
                ["download", "s", after],
            ],
        },
        errors=True,
    )
    assert "The graphics driver has failed" in results[6]
    assert results[9] is False
    assert drawn(before).mean() > 0.1
    assert (pixels(before) != pixels(after)).mean() < 0.001


def test_errors_outlast_a_lost_context(browse, serve, torus, tmp_path):
    """Errors of files, before and while the context is lost."""
    (tmp_path / "bad.glb").write_bytes(b"no model")

    def change(action: str, event: str) -> list[str]:
        context = "canvas.getContext('webgl2').getExtension('WEBGL_lose_context')"
        code = f"{{ once: true }}); (globalThis.lost ??= {context}).{action}Context(); }})"
        told = f"canvas.addEventListener('webglcontext{event}', () => setTimeout(done), "
        return ["evaluate", f"new Promise((done) => {{ {told}{code}"]

    lose, restore = change("lose", "lost"), change("restore", "restored")
    bad, good = (["drop", [[path.name, str(path)]]] for path in (tmp_path / "bad.glb", torus))
    text = ["text", "#error"]
    before = [bad, ["wait", "error"], text, lose, text, restore, text]
    meanwhile = [good, SHOWN, lose, text, bad, ["wait", "error"], restore, text]
    (results,) = browse(
        {"address": serve(torus), "steps": [SHOWN, *before, *meanwhile]}, errors=True
    )
    assert "bad.glb" in results[3]
    assert results[3] == results[5] == results[7] == results[15]
    assert "The graphics driver has failed" in results[11]


def test_mouse_touch_and_buttons(browse, serve, torus, tmp_path):
    before, after, touched = (str(tmp_path / f"{name}.png") for name in "abc")
    (results,) = browse(
        {
            "address": serve(torus),
            "steps": [
                SHOWN,
                ["download", "s", before],
                ["drag", 150, 60],
                PAINTED,
                ["download", "s", after],
                ["click", "#meshlets"],
                ["attribute", "#meshlets", "aria-pressed"],
                ["key", "Space"],  # presses the button again, which has the focus
                ["attribute", "#meshlets", "aria-pressed"],
                ["click", "#info"],
                ["visible", "#details"],
                ["click", "#help"],
                ["visible", "#keys"],
                ["key", "m"],  # not behind the dialog
                ["attribute", "#meshlets", "aria-pressed"],
                ["key", "Escape"],
                ["visible", "#keys"],
                ["click", "#theme"],
                ["evaluate", "document.documentElement.dataset.theme"],
                ["reload"],
                PAINTED,
                SHOWN,
                ["evaluate", "document.documentElement.dataset.theme"],
                ["visible", "#play"],
                ["key", "r"],
                ["key", "t"],
                ["touch", 0, 80],
                PAINTED,
                ["download", "s", touched],
            ],
        }
    )
    assert (drawn(before) != drawn(touched)).mean() > 0.01
    assert (drawn(before) != drawn(after)).mean() > 0.01
    assert [results[i] for i in (6, 8, 10, 12, 14, 16)] == [
        "true",
        "false",
        False,
        True,
        "false",
        False,
    ]
    assert (results[18], results[22]) == ("light", "light")
    assert results[23] is False


def test_compressed_file_can_be_saved(browse, serve, torus, tmp_path):
    (results,) = browse(
        {
            "address": serve(torus),
            "steps": [
                SHOWN,
                ["visible", "#save"],
                ["download", "d", str(tmp_path / "saved.glb")],
            ],
        }
    )
    assert results == ["ready", True, "torus.compressed.glb"]
    (compressed,) = tmp_path.glob("work-0/compressed.glb")
    assert (tmp_path / "saved.glb").read_bytes() == compressed.read_bytes()


def test_focus_is_visible_on_the_canvas(browse, serve, torus):
    """Its outline lies inside: the window would cut off one outside."""
    offset = "canvas.focus(), parseFloat(getComputedStyle(canvas).outlineOffset)"
    (results,) = browse(
        {"address": serve(torus), "steps": [SHOWN, ["key", "Tab"], ["evaluate", offset]]}
    )
    assert results[2] <= -2


def test_phone_width(browse, serve, torus, tmp_path):
    """All buttons are inside a narrow window, and the panes lie one above the other.

    No label covers another, and nothing covers the model.
    """
    outside = """[...document.querySelectorAll('button')].filter((button) => {
      const { left, right, top, bottom, width } = button.getBoundingClientRect();
      return width > 0 && (left < 0 || right > innerWidth || top < 0 || bottom > innerHeight);
    }).length"""
    covered = """(() => {
      document.getElementById('play').hidden = false;
      const places = [...document.querySelectorAll('#tools span')]
        .map((label) => label.getBoundingClientRect());
      const { top } = document.getElementById('canvas').getBoundingClientRect();
      const { bottom } = document.querySelector('header').getBoundingClientRect();
      return places.slice(1).filter(({ left }, i) => left <= places[i].right).length +
        (top < bottom);
    })()"""
    picture = str(tmp_path / "phone.png")
    (results,) = browse(
        {
            "address": serve(torus),
            "width": 360,
            "height": 740,
            "scheme": "light",
            "steps": [
                SHOWN,
                ["visible", "#details"],
                ["evaluate", outside],
                ["click", "#original"],
                PAINTED,
                SHOWN,
                ["click", "#info"],
                ["evaluate", outside],
                ["click", "#info"],
                PAINTED,
                ["download", "s", picture],
                ["evaluate", covered],
            ],
        }
    )
    assert (results[0], results[1], results[2], results[7]) == ("ready", False, 0, 0)
    assert results[-1] == 0
    top, bottom = np.array_split(drawn(Path(picture), "light"), 2)
    assert top.mean() > 0.05 and abs(top.mean() - bottom.mean()) < 0.01


def choose(name: str, value: str) -> list[str]:
    return ["evaluate", f"{name}.value = '{value}'; {name}.dispatchEvent(new Event('change'))"]


def test_panel_of_comparisons_fits_a_phone(browse, serve, torus):
    """It lies inside the window and covers no label."""
    problems = """(() => {
      const rectOf = (id) => document.getElementById(id).getBoundingClientRect();
      const { left, right, top, bottom } = rectOf('comparing');
      const covers = ['label-original', 'label-compressed'].filter((id) => {
        const label = rectOf(id);
        return label.width > 0 && label.left < right && label.right > left &&
          label.top < bottom && label.bottom > top;
      });
      return [...covers, ...(left < 8 || right > innerWidth - 8 ? ['outside'] : [])];
    })()"""
    kinds = ("beside", "wipe", "distance", "normal")
    steps = [step for kind in kinds for step in (choose("compare", kind), ["evaluate", problems])]
    opened = [SHOWN, ["key", "o"], PAINTED, SHOWN]
    page = {"address": serve(torus), "width": 360, "height": 740, "steps": [*opened, *steps]}
    (results,) = browse(page)
    assert dict(zip(kinds, results[5::2])) == {kind: [] for kind in kinds}


def places_in_a_grid() -> dict[str, np.ndarray]:
    """TRANSLATION of 4 x 3 instances, none of which covers another's ball."""
    x, y = np.meshgrid(np.arange(4), np.arange(3))
    return {"TRANSLATION": 3 * np.stack([x, y, 0 * x], -1).reshape(-1, 3).astype(np.float32)}


@pytest.mark.parametrize("lod", [False, True])
def test_all_instances_are_on_the_screen(browse, serve, tmp_path, lod):
    """Of EXT_mesh_gpu_instancing: each has a red ball."""
    if lod:
        environment.need_package("meshoptimizer")
    picture = tmp_path / "picture.png"
    path = write_instanced(tmp_path / "balls.glb", places_in_a_grid(), lod=lod)
    (results,) = browse(
        {"address": serve(path), "steps": [SHOWN, PAINTED, ["download", "s", str(picture)]]}
    )
    assert results[0] == "ready"
    red, green, _ = np.moveaxis(pixels(picture), -1, 0)
    labels, count = ndimage.label(red > green + 40)
    assert count == 12
    assert np.bincount(labels.ravel()).min() > 100


def write_ball(path: Path, *, normals: bool) -> Path:
    builder = Builder()
    positions, triangles = ball(40, 30)
    builder.mesh({"POSITION": positions, **({"NORMAL": positions} if normals else {})}, triangles)
    return builder.write(path)


def test_heat_map_of_a_model_depends_on_no_earlier_one(browse, serve, tmp_path):
    """With normals, then without."""
    smooth, flat = (write_ball(tmp_path / f"{n}.glb", normals=n > 0) for n in (1, 0))
    first, second = str(tmp_path / "first.png"), str(tmp_path / "second.png")
    compare = [["key", "o"], PAINTED, SHOWN, choose("compare", "normal"), PAINTED]
    browse(
        {
            "address": serve(smooth),
            "steps": [
                SHOWN,
                *compare,
                ["drop", [[flat.name, str(flat)]]],
                SHOWN,
                PAINTED,
                SHOWN,
                PAINTED,
                ["download", "s", second],
            ],
        },
        {"address": serve(flat), "steps": [SHOWN, *compare, ["download", "s", first]]},
    )
    assert drawn(Path(first)).mean() > 0.1
    assert (pixels(first) != pixels(second)).mean() < 0.01


def test_models_and_lights_leave_nothing_on_the_gpu(browse, serve, torus, tmp_path):
    """Instances have buffers of their own, lights have textures."""
    path = write_instanced(tmp_path / "balls.glb", places_in_a_grid(), lod=False)
    watch = """(() => {
      globalThis.alive = {};
      const known = WebGL2RenderingContext.prototype;
      for (const kind of ['Buffer', 'Texture', 'Framebuffer', 'Renderbuffer']) {
        const [make, free] = [known[`create${kind}`], known[`delete${kind}`]];
        alive[kind] = 0;
        known[`create${kind}`] = function () { alive[kind]++; return make.call(this); };
        known[`delete${kind}`] = function (one) {
          alive[kind] -= one ? 1 : 0;
          free.call(this, one);
        };
      }
    })()"""
    shows = "models.selectedIndex = {}; models.dispatchEvent(new Event('change'))"
    opens = [
        step for n in (0, 1) for step in (["evaluate", shows.format(n)], PAINTED, SHOWN, PAINTED)
    ]
    told = ["evaluate", "({ ...alive })"]
    steps = [SHOWN, ["evaluate", watch], ["drop", [[path.name, str(path)]]], SHOWN, *opens]
    for light in ("sky", "studio"):
        steps += [choose("environment", light), PAINTED, told]
    steps += [*opens, told]
    (results,) = browse({"address": serve(torus), "width": 400, "height": 300, "steps": steps})
    before, after_lights, after_models = (one for one in results if isinstance(one, dict))
    assert before == after_lights
    assert before == after_models


def test_boxes_and_sliders_tell_the_truth(browse, serve, bunny):
    """The space bar is for a box that has the focus; a model that opens is not frozen."""
    little = "megabytes.min = 0; " + choose("megabytes", "0")[1]
    (results,) = browse(
        {
            "address": serve(bunny),
            "steps": [
                SHOWN,
                ["evaluate", "turns.focus()"],
                ["key", "Space"],
                ["evaluate", "turns.checked"],
                ["key", "Space"],
                ["evaluate", "freeze.click(), freeze.checked"],
                ["evaluate", "models.dispatchEvent(new Event('change'))"],
                SHOWN,
                ["evaluate", "freeze.checked"],
                ["evaluate", little],
                ["evaluate", "[megabytes.value, document.getElementById('megabytes-value').value]"],
                ["text", "#status"],
            ],
        }
    )
    assert (results[3], results[5], results[8]) == (True, True, False)
    assert results[10] == ["6", "64 MB"]
    assert "too small" in results[11]


@pytest.mark.parametrize(
    "name", ["DamagedHelmet.glb", "nasty/CesiumMan_skinned.glb", "nasty/AnimatedMorphCube.glb"]
)
def test_compressed_looks_like_the_original(browse, serve, model, tmp_path, name):
    """Textures, skins and morph targets; meshlets too, which have geometry of their own."""
    beside, meshlets = str(tmp_path / "beside.png"), str(tmp_path / "meshlets.png")
    (results,) = browse(
        {
            "address": serve(model(name)),
            "width": 1000,  # panes side by side
            "steps": [
                SHOWN,
                ["key", "o"],
                PAINTED,
                SHOWN,
                ["download", "s", beside],
                ["key", "m"],
                ["download", "s", meshlets],
            ],
        }
    )
    assert results[0] == "ready"
    for picture in (beside, meshlets):
        left, right = halves(drawn(picture))
        assert left.mean() > 0.03
        assert (left != right).sum() < 0.02 * left.sum()
    left, right = halves(pixels(beside))
    assert abs(left - right).mean() < 2
    assert colours(meshlets) > 5 or "Cube" in name


def test_dropped_files(browse, serve, torus, tmp_path):
    """Compressed by the server if need be; the list goes back; a .gltf comes with its files."""
    gltf_ext.compress(torus, tmp_path / "small.glb")
    trimesh.creation.icosphere(3).export(tmp_path / "ball.stl")
    properties = glb_json(torus)
    length = properties["buffers"][0]["byteLength"]
    data = torus.read_bytes()
    start = data.index(b"BIN\0") + 4
    (tmp_path / "part 1.bin").write_bytes(data[start : start + length])
    properties["buffers"][0]["uri"] = "part%201.bin"
    (tmp_path / "torus.gltf").write_text(json.dumps(properties))

    def drop(*names: str) -> list[Any]:
        return ["drop", [[name, str(tmp_path / name)] for name in names]]

    def show(*names: str) -> list[list[Any]]:
        return [drop(*names), SHOWN, ["text", "#details"], ["evaluate", "document.title"]]

    steps = [
        SHOWN,
        *show("small.glb"),
        *show("ball.stl"),
        *show("part 1.bin", "torus.gltf"),
        *show("torus.gltf"),
        ["text", "#error"],
        ["evaluate", "models.selectedIndex = 1; models.dispatchEvent(new Event('change'))"],
        PAINTED,
        SHOWN,
        ["evaluate", "document.title"],
    ]
    (results,) = browse({"address": serve(torus), "steps": steps}, errors=True)
    assert results[2:5] == ["ready", results[3], "small.glb \u2013 gltf-meshlet"]
    assert results[6] == "ready" and results[8] == "ball.stl \u2013 gltf-meshlet"
    assert "Triangles\t\t1,280\n" in results[7] and "Compress\t\t" in results[7]
    assert f"File\t{(tmp_path / 'ball.stl').stat().st_size / 1000:.1f} kB" in results[7]
    assert results[10] == "ready" and "Compress\t\t" in results[11]
    assert results[14] == "error"
    assert results[17] == (
        "torus.gltf cannot be shown\n\nIt refers to part 1.bin; open both files together"
    )
    assert results[-2:] == ["ready", "small.glb \u2013 gltf-meshlet"]


def test_errors_are_shown(browse, serve, torus, tmp_path):
    """Damaged, empty and foreign files: a sentence, and no scene."""
    gltf_ext.compress(torus, tmp_path / "damaged.glb")
    data = bytearray((tmp_path / "damaged.glb").read_bytes())
    data[data.index(b"EBM1") + 4] = 77  # the version
    (tmp_path / "damaged.glb").write_bytes(data)
    (tmp_path / "cut.glb").write_bytes(data[: len(data) // 2])
    (tmp_path / "text.glb").write_text("no glTF")
    (tmp_path / "notes.txt").write_text("no model")
    (tmp_path / "empty.glb").write_bytes(b"")
    builder = Builder()
    positions, triangles = grid_mesh(4, 4)
    builder.mesh({"POSITION": positions}, triangles)
    builder.properties["extensionsUsed"] = builder.properties["extensionsRequired"] = [
        "EXT_from_elsewhere"
    ]
    builder.write(tmp_path / "foreign.glb")
    expected = {
        "cut.glb": "",
        "text.glb": "It is no .glb, and its JSON cannot be read",
        "notes.txt": "No model among the files; use one of .glb .gltf .obj .ply .stl",
        "empty.glb": "It is no .glb, and its JSON cannot be read",
        "damaged.glb": "Mesh 0 primitive 0: ",
        "foreign.glb": "It requires EXT_from_elsewhere, which this page cannot read",
    }
    steps = [SHOWN]
    for name in expected:
        steps += [["drop", [[name, str(tmp_path / name)]]], SHOWN, ["text", "#error"]]
    steps += [["visible", "#details"], ["attribute", "#screenshot", "disabled"]]
    (results, first) = browse(
        {"address": serve(torus), "steps": steps},
        {"address": serve(tmp_path / "damaged.glb"), "steps": [SHOWN, ["text", "#error"]]},
        errors=True,
    )
    for number, (name, problem) in enumerate(expected.items()):
        state, text = results[3 * number + 2 : 3 * number + 4]
        assert state == "error", name
        assert text.startswith(f"{name} cannot be shown\n\n") and problem in text, text
    assert results[-2:] == [False, ""]
    assert first[0] == "error" and "version" in first[1]


def test_malformed_vectors_are_errors(browse, serve, torus):
    files = sorted(VECTORS.glob("malformed_*.glb"))
    assert files
    steps: list[list[Any]] = [SHOWN]
    for file in files:
        steps += [["drop", [[file.name, str(file)]]], SHOWN]
    (results,) = browse({"address": serve(torus), "steps": steps}, errors=True)
    states = dict(zip((file.name for file in files), results[2::2]))
    reasons = json.loads((VECTORS / "malformed.json").read_text())
    for_readers = {name for name in states if not reasons[name]["validators_only"]}
    assert len(for_readers) > 10
    assert {states[name] for name in for_readers} == {"error"}, states
    assert set(states.values()) <= {"error", "ready"}, states


def test_exported_page(browse, static, torus, tmp_path):
    """On a plain server, in a folder of it; what is dropped stays uncompressed, and says so."""
    (tmp_path / "root").mkdir()
    assert main(["view", str(torus), "--export", str(tmp_path / "root" / "site")]) == 0
    ball = trimesh.creation.icosphere(2)
    for suffix in ("glb", "obj", "ply", "stl"):
        ball.export(tmp_path / f"ball.{suffix}")
    steps: list[list[Any]] = [SHOWN, ["key", "o"], PAINTED, SHOWN, ["visible", "#label-original"]]
    for suffix in ("glb", "obj", "ply", "stl"):
        steps += [
            ["drop", [[f"ball.{suffix}", str(tmp_path / f"ball.{suffix}")]]],
            SHOWN,
            ["text", "#details"],
            ["attribute", "#meshlets", "disabled"],
        ]
    (results,) = browse({"address": static(tmp_path / "root") + "site/", "steps": steps})
    assert results[0] == "ready" and results[4] is True
    for at in range(5, len(results), 4):
        assert results[at + 1] == "ready"
        assert "Triangles\t320\n" in results[at + 2]
        assert "Shown uncompressed: this page has no server" in results[at + 2]
        assert results[at + 3] == ""


FRAME = """<!doctype html>
<style>body { margin: 0 } iframe { border: 0; width: 100vw; height: 100vh; display: block }</style>
<iframe src="site/index.html"></iframe>
<script>
  const timer = setInterval(() => {
    const { state } = document.querySelector('iframe').contentDocument.body?.dataset ?? {};
    if (!['ready', 'error'].includes(state)) return;
    clearInterval(timer);
    requestAnimationFrame(() => (window.done = { state }));
  }, 100);
</script>
"""


def test_servers_without_ranges_send_a_file_once(browse, static, torus, model, tmp_path):
    environment.need_package("meshoptimizer")
    gltf_ext.compress(model("suzanne.glb"), tmp_path / "levels.glb", lod=True)
    (tmp_path / "root").mkdir()
    for number, path in enumerate((torus, tmp_path / "levels.glb")):
        assert main(["view", str(path), "--export", str(tmp_path / "root" / str(number))]) == 0
    address = static(tmp_path / "root")
    names = "performance.getEntriesByType('resource').map(({ name }) => name)"
    count = f"{names}.filter((name) => name.endsWith('.glb')).length"
    steps = [SHOWN, ["evaluate", count], ["visible", "#levels"], ["text", "#details"]]
    results = browse(*({"address": f"{address}{n}/", "steps": steps} for n in range(2)))
    assert [one[:3] for one in results] == [["ready", 1, False], ["ready", 1, True]]
    size = (tmp_path / "levels.glb").stat().st_size
    assert re.search(rf"Fetched\s+{size / 1000:.1f} kB", results[1][3])


def test_models_are_compared(browse, serve, tmp_path):
    """The wipe shows one on its left, the other on its right. Heat maps are colder the nearer the
    models are."""
    ball = trimesh.creation.icosphere(4, 1.0)
    ball.export(tmp_path / "ball.glb")
    trimesh.creation.icosphere(4, 1.02).export(tmp_path / "larger.glb")
    gltf_ext.compress(tmp_path / "ball.glb", tmp_path / "model.glb")
    how = "compare.value = '{}'; compare.dispatchEvent(new Event('change'))"
    kinds = ("beside", "wipe", "distance", "normal")
    shown = {}
    for original in ("ball", "larger"):
        to = {name: str(tmp_path / f"{original}-{name}.png") for name in (*kinds, "left")}
        steps = [SHOWN, ["key", "o"], PAINTED, SHOWN, PAINTED]
        for name in kinds:
            steps += [["evaluate", how.format(name)], PAINTED, ["download", "s", to[name]]]
        steps += [
            ["text", "#scale"],
            ["evaluate", how.format("wipe")],
            ["evaluate", "wipe.focus()"],
        ]
        steps += [*[["key", "ArrowLeft"]] * 6, PAINTED, ["download", "s", to["left"]]]
        steps += [["attribute", "#wipe", "aria-valuenow"]]
        address = serve(tmp_path / "model.glb", tmp_path / f"{original}.glb")
        (results,) = browse({"address": address, "width": 1000, "steps": steps})
        assert results[-1] == "20"
        assert "0.1°" in results[-12] and "100°" in results[-12]
        shown[original] = {name: pixels(Path(path)) for name, path in to.items()}
    one, two = shown["ball"], shown["larger"]
    middle = one["wipe"].shape[1] // 2
    differs = (one["wipe"] != two["wipe"]).any(axis=2)
    # Either original fills the view; the ball beside the larger one is smaller then.
    assert differs[:, middle + 2 :].mean() > 10 * differs[:, :middle].mean()
    assert differs[:, middle + 2 :].mean() > 0.002
    moved = (two["wipe"] != two["left"]).any(axis=(0, 2))
    assert moved[: middle // 3].sum() == moved[middle + 2 :].sum() == 0 < moved.sum()
    assert warmth(two["distance"]) > 5
    for cold in (one["distance"], one["normal"], two["normal"]):
        assert warmth(cold) < 0.5
    assert (one["beside"] != one["wipe"]).any(axis=2).mean() > 0.05


def warmth(picture):
    """Red beside blue, where something is drawn."""
    shown = (abs(picture - SCENE["dark"]) > 3).any(axis=2)
    return picture[..., 0][shown].sum() / picture[..., 2][shown].sum()


def test_scans_without_a_material_show_their_relief(browse, serve, model, tmp_path):
    """Mid grey, lit and in shadow; other light, and a model that turns, look otherwise."""
    pictures = {name: str(tmp_path / f"{name}.png") for name in ("first", "lit", "sky", "turned")}
    lit = "angle.value = 120; angle.dispatchEvent(new Event('input'))"
    sky = "environment.value = 'sky'; environment.dispatchEvent(new Event('change'))"
    wait = ["evaluate", "new Promise((end) => setTimeout(end, 900))"]
    steps = [SHOWN, ["download", "s", pictures["first"]]]
    steps += [["evaluate", lit], PAINTED, ["download", "s", pictures["lit"]]]
    steps += [["evaluate", sky], PAINTED, ["download", "s", pictures["sky"]]]
    steps += [["evaluate", "turns.click()"], wait, ["evaluate", "turns.click()"], PAINTED]
    steps += [["download", "s", pictures["turned"]]]
    steps += [["evaluate", "document.querySelectorAll('h1').length"]]
    steps += [["evaluate", "details.scrollWidth <= details.clientWidth"]]
    (results,) = browse({"address": serve(model("suzanne.glb")), "steps": steps})
    assert results[-2:] == [1, True]
    first = pixels(Path(pictures["first"]))
    grey = first.max(axis=2)[drawn(Path(pictures["first"]))]
    assert 90 < np.median(grey) < 160
    assert np.percentile(grey, 90) - np.percentile(grey, 10) > 60
    assert grey.max() <= 235
    before = first
    for name in ("lit", "sky", "turned"):
        after = pixels(Path(pictures[name]))
        assert (abs(after - before) > 8).any(axis=2).mean() > 0.02, name
        before = after


def test_exported_page_in_firefox(torus, tmp_path):
    assert main(["view", str(torus), "--export", str(tmp_path / "site")]) == 0
    (tmp_path / "frame.html").write_text(FRAME)
    (shown,) = browsers.pictures("firefox", "files/frame.html", tmp_path, "exported")
    assert shown == {"state": "ready"}
    # The page's style applies, and the torus lies in the middle.
    middle = drawn(tmp_path / "exported.png", "light")[140:340, 200:440]
    assert 0.1 < middle.mean() < 0.9


def test_exported_page_without_its_files_is_an_error(browse, static, torus, tmp_path):
    assert main(["view", str(torus), "--export", str(tmp_path / "site")]) == 0
    texts = {}
    for name in ("decoder.wasm", "model/compressed.glb", "models.json"):
        (tmp_path / "site" / name).rename(tmp_path / "moved")
        (results,) = browse(
            {"address": static(tmp_path / "site"), "steps": [SHOWN, ["text", "#error"]]},
            errors=True,
        )
        (tmp_path / "moved").rename(tmp_path / "site" / name)
        assert results[0] == "error"
        texts[name] = results[1]
    assert all("404" in text for text in texts.values()), texts
    assert "decoder.wasm" in texts["decoder.wasm"]


def test_a_file_that_names_another_host_asks_nobody(browse, serve, torus, tmp_path):
    """An image on another host: a warning, and no request to it (checked by `browse`)."""
    properties = glb_json(torus)
    properties["images"] = [{"uri": "http://elsewhere.example/a.png"}]
    properties["textures"] = [{"source": 0}]
    properties["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    properties["meshes"][0]["primitives"][0]["material"] = 0
    text = json.dumps(properties).encode()
    text += b" " * (-len(text) % 4)
    data = torus.read_bytes()
    rest = data[20 + int.from_bytes(data[12:16], "little") :]
    length = (20 + len(text) + len(rest)).to_bytes(4, "little")
    head = data[:8] + length + len(text).to_bytes(4, "little") + b"JSON"
    (tmp_path / "away.glb").write_bytes(head + text + rest)
    gltf_ext.compress(tmp_path / "away.glb", tmp_path / "away-small.glb")
    (results,) = browse(
        {
            "address": serve(tmp_path / "away-small.glb"),
            "steps": [SHOWN, ["text", "#details"]],
        },
        errors=True,
    )
    assert results[0] == "ready" and "1 of its textures cannot be read" in results[1]
