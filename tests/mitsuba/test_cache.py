"""The cache of decoded meshlets: limit, statistics, threads."""

from __future__ import annotations

import gc
import shutil
import subprocess
import threading

import numpy as np
import pytest

from tests.helpers.environment import ROOT
from tests.helpers.mitsuba_reference import VARIANTS, picture, require, scene, shapes_of, sheet

PATH = {"type": "path", "max_depth": 3}
FRACTIONS = (0.0, 0.1, 0.25, 0.5, 1.0)


@pytest.mark.parametrize(
    "sanitizer", ["thread", pytest.param("address,undefined", marks=pytest.mark.full)]
)
def test01_stress(sanitizer, tmp_path):
    """Many threads on one small cache, under sanitizers."""
    compiler = shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        pytest.skip("no C++ compiler")
    source = ROOT / "mitsuba_plugin" / "src"
    subprocess.run(
        [
            compiler,
            "-std=c++17",
            "-g",
            "-O1",
            f"-fsanitize={sanitizer}",
            "-fno-sanitize-recover=all",
            "-pthread",
            f"-I{source}",
            ROOT / "tests" / "mitsuba" / "native" / "stress.cpp",
            source / "cache.cpp",
            "-o",
            tmp_path / "stress",
        ],
        check=True,
    )
    result = subprocess.run([tmp_path / "stress"], capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test02_limits(variant, tmp_path):
    """The cache stays within its limit; the picture does not depend on it."""
    _, plugin = require(variant)
    path, primitives = sheet(tmp_path)
    pictures = []
    for fraction in FRACTIONS:
        s = scene(shapes_of(path, primitives, cache=fraction), PATH)
        pictures.append(picture(s, spp=8))
        figures = plugin.statistics(s)
        assert (
            figures["resident_bytes"]
            <= figures["limit_bytes"]
            == pytest.approx(fraction * figures["decoded_bytes"], abs=1)
        )
        assert figures["hits"] > 0 and figures["misses"] == figures["decoded"]
        assert (figures["resident_entries"] > 0) == (fraction > 0)
        if fraction == 1:
            assert (
                figures["evictions"] == 0
            )  # refused also counts meshlets that met another thread in the cache
    assert all(np.array_equal(pictures[0], other) for other in pictures[1:])


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test03_limit_in_bytes(variant, tmp_path):
    _, plugin = require(variant)
    path, primitives = sheet(tmp_path)
    s = scene(shapes_of(path, primitives, cache_bytes=20_000), PATH)
    picture(s, spp=4)
    figures = plugin.statistics(s)
    assert 0 < figures["resident_bytes"] <= figures["limit_bytes"] == 20_000


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test04_shared_cache(variant, tmp_path):
    mi, plugin = require(variant)
    path, primitives = sheet(tmp_path)
    shape = shapes_of(path, primitives, cache_bytes=10_000, cache_group="test04" + variant)[
        "shape_0"
    ]
    loaded = [
        mi.load_dict({**shape, "to_world": mi.ScalarTransform4f().translate([0, i, 0])})
        for i in range(3)
    ]
    assert [plugin.statistics(s)["limit_bytes"] for s in loaded] == [30_000] * 3
    picture(scene({f"shape_{i}": s for i, s in enumerate(loaded)}, PATH), spp=4)
    assert 0 < plugin.statistics(loaded[0])["resident_bytes"] <= 30_000
    together = plugin.statistics(
        mi.load_dict({"type": "scene", **{f"shape_{i}": s for i, s in enumerate(loaded)}})
    )
    assert together["limit_bytes"] == 30_000
    assert together["triangles"] == 3 * plugin.statistics(loaded[0])["triangles"]


def test05_a_shape_that_goes_gives_its_share_back(tmp_path):
    mi, plugin = require("scalar_rgb")
    path, primitives = sheet(tmp_path)
    shape = shapes_of(path, primitives, cache_bytes=10_000, cache_group="test05")["shape_0"]
    first, second = mi.load_dict(shape), mi.load_dict(shape)
    picture(scene({"first": first}, PATH), spp=4)
    assert plugin.statistics(first)["limit_bytes"] == 20_000
    assert plugin.statistics(first)["resident_bytes"] > 10_000
    del second
    gc.collect()
    figures = plugin.statistics(first)
    assert figures["limit_bytes"] == 10_000
    assert 0 < figures["resident_bytes"] <= 10_000


def test06_counts_keep_what_is_popular(tmp_path):
    """Meshlets that many rays needed survive a look at everything else, but not for ever."""
    mi, plugin = require("scalar_rgb")
    path, primitives = sheet(tmp_path)
    shape = mi.load_dict(shapes_of(path, primitives, cache=0.15)["shape_0"])
    s = mi.load_dict({"type": "scene", "shape": shape})

    def look(points, repeat=1):
        for _ in range(repeat):
            for x, y in points:
                assert s.ray_test(
                    mi.Ray3f(mi.Point3f(float(x), float(y), 2), mi.Vector3f(0, 0, -1))
                )

    random = np.random.default_rng(0)
    corner = random.random((20, 2)) * 0.1 + 0.05
    look(corner, 50)
    look(random.random((200, 2)) * [1.9, 0.9] + 0.05)
    plugin.statistics(shape, reset=True)
    look(corner)
    assert plugin.statistics(shape)["misses"] <= 2


def test07_statistics_while_rendering(tmp_path):
    _mi, plugin = require("scalar_rgb")
    path, primitives = sheet(tmp_path)
    s = scene(shapes_of(path, primitives, cache=0.25), PATH, size=(256, 256))
    shape, seen, done = s.shapes()[0], [], threading.Event()

    def watch():
        while not done.is_set():
            seen.append(plugin.statistics(shape)["hits"])
            done.wait(0.005)

    watcher = threading.Thread(target=watch)
    watcher.start()
    picture(s, spp=16)
    done.set()
    watcher.join()
    assert seen == sorted(seen) and len(set(seen)) > 2


@pytest.mark.parametrize("variant", VARIANTS[:2])
def test08_threads(variant, tmp_path):
    """One thread and many give the same picture."""
    _mi, _ = require(variant)
    import drjit as dr

    path, primitives = sheet(tmp_path)
    before, pictures = dr.thread_count(), []
    blocks = {
        **PATH,
        "block_size": 16,
    }  # the default depends on the threads, and random numbers depend on it
    try:
        for count in (1, 4):
            dr.set_thread_count(count)
            pictures.append(picture(scene(shapes_of(path, primitives, cache=0.1), blocks), spp=8))
    finally:
        dr.set_thread_count(before)
    assert np.array_equal(*pictures)


def test09_shapes_go_away(tmp_path):
    mi, _plugin = require("scalar_rgb")
    path, primitives = sheet(tmp_path)
    shape = mi.load_dict(shapes_of(path, primitives)["shape_0"])
    cache_id = int(mi.traverse(shape)["cache_id"])
    from mitsuba_plugin import native

    assert cache_id in native._cache_ids(None)
    del shape
    import gc

    gc.collect()
    assert cache_id not in native._cache_ids(None)
