"""Decoding on the GPU beside the shaders of meshoptimizer and AMD DGF: triangles per second.

In two steps, since a machine with a GPU may lack the rest. With the checkouts that meshlet_peers.py
names and Slang's compiler slangc on the PATH:

    python -m bench vulkan_peers FOLDER --prepare FILE.glb ...

Then, with a GPU and this FOLDER: python -m bench vulkan_peers FOLDER. Models have positions and
triangles alone. Every result is compared with the CPU's; rows say if it differs. Times are the
GPU's own.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
from pathlib import Path
from typing import ClassVar

import numpy as np

from bench import meshlet_peers, peers
from bench.common import best_in_bold, markdown_table, progress, spread
from bench.vulkan_decode import REPEAT, WARM_UP

PACKAGES = ("numpy", "vulkan")
METHODS = ("traversal", "team", "serial")  # ours: bench.gpu_decoder
MESHOPT, DGF = "meshopt", "dgf"  # also in names of files
TITLES = {MESHOPT: "meshopt meshlets, triangles only", DGF: "AMD DGF, HPG24"}
DGF_BLOCK = 64  # triangles and vertices of a block, at most
ROW = 65535  # workgroups in a row of a dispatch: the most that Vulkan guarantees
MESHOPT_GROUP = 32  # meshlets of a workgroup of meshletdec.slang
FEATURES = {
    "VkPhysicalDeviceVulkan11Features": (
        "storageBuffer16BitAccess",
        "uniformAndStorageBuffer16BitAccess",
    ),
    "VkPhysicalDeviceVulkan12Features": (
        "storageBuffer8BitAccess",
        "uniformAndStorageBuffer8BitAccess",
        "shaderInt8",
    ),
}


# --- prepare: encode and compile ---


def prepare(folder: Path, models: list[Path]) -> None:
    """Writes the models in all formats and the compiled shaders of the other projects."""
    try:
        meshopt, dgf = meshlet_peers.MeshoptMeshlets(), meshlet_peers.DenseGeometry("HPG24")
    except peers.PeerMissing as missing:
        raise SystemExit(f"bench vulkan_peers: {missing}") from None
    if shutil.which("slangc") is None:
        raise SystemExit("bench vulkan_peers: Slang's compiler slangc is not on the PATH")
    folder.mkdir(parents=True, exist_ok=True)
    shaders = meshlet_peers.PROGRAMS
    _compile(meshopt.checkout / "demo" / "meshletdec.slang", "decodeMeshlets", folder / MESHOPT)
    includes = dgf.checkout / "DGFSample" / "shaders"
    _compile(shaders / "dgf_blocks.slang", "decodeBlocks", folder / DGF, f"-I{includes}")
    for path in models:
        primitives = peers.read_primitives(path, {"POSITION": peers.ATTRIBUTES["POSITION"]})
        blob = max(meshlet_peers.compressed(primitives)[1], key=len)
        parts = meshlet_peers.integers_of(primitives)
        (folder / f"{path.stem}.blob").write_bytes(blob)
        for name, peer in ((MESHOPT, meshopt), (DGF, dgf)):
            run = peer.run(parts, folder / f"{path.stem}.{name}")
            _save_expected(folder / f"{path.stem}.{name}.npz", run.decoded)
        progress(path.stem)
    versions = {TITLES[MESHOPT]: meshopt.version, TITLES[DGF]: dgf.version}
    described = {"models": [path.stem for path in models], "peers": versions}
    (folder / "prepared.json").write_text(json.dumps(described))


def _compile(shader: Path, entry: str, output: Path, *options: str) -> None:
    command = ["slangc", shader, "-target", "spirv", "-entry", entry, "-stage", "compute", "-O2"]
    arguments = [*command, *options, "-o", output.with_name(f"{output.name}.spv")]
    done = subprocess.run(arguments, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"bench vulkan_peers: slangc rejects {shader.name}: {done.stderr[-300:]}")


def _save_expected(path: Path, parts: list[meshlet_peers.Integers]) -> None:
    """Triangles and positions of all parts as one."""
    first = np.cumsum([0, *(len(part.values) for part in parts)])
    triangles = np.concatenate([part.triangles + n for part, n in zip(parts, first)])
    positions = np.concatenate([part.values for part in parts])
    np.savez_compressed(path, triangles=triangles.astype(np.uint32), positions=positions)


# --- measure ---


def measure(options: argparse.Namespace) -> dict:
    """All prepared models in all formats."""
    if options.prepare:
        prepare(options.folder, options.prepare)
        raise SystemExit(0)
    from vk_backend.device import NEEDED, Device

    class WithBytes(Device):
        """A device whose shaders read 8 and 16 bits."""

        needed: ClassVar = {
            name: (*NEEDED.get(name, ()), *FEATURES.get(name, ()))
            for name in {**NEEDED, **FEATURES}
        }

    try:
        prepared = json.loads((options.folder / "prepared.json").read_text())
    except FileNotFoundError:
        raise SystemExit(
            f"bench vulkan_peers: prepare {options.folder} first, see --help"
        ) from None
    rows = []
    with WithBytes(options.device) as device:
        for model in prepared["models"]:
            for name, milliseconds, triangles, same in _all_formats(device, options.folder, model):
                rows.append(
                    {
                        "model": model,
                        "format": name,
                        "triangles": triangles,
                        "same": same,
                        "milliseconds": spread(milliseconds[-REPEAT:].tolist()),
                        "triangles_per_second": triangles / np.median(milliseconds[-REPEAT:]) * 1e3,
                    }
                )
                rate = rows[-1]["triangles_per_second"] / 1e9
                note = "" if same else ", but it differs from the CPU"
                progress(f"{model}, {name}: {rate:.2f} billion/s{note}")
        described = {"name": device.name, "driver": device.driver}
    return {"rows": rows, "peers": prepared["peers"], "device": described}


def _all_formats(device, folder: Path, model: str):
    """Yields (format, milliseconds of each run, triangles, whether they are the CPU's)."""
    from bench.gpu_decoder import GpuDecoder

    blob = (folder / f"{model}.blob").read_bytes()
    for method in METHODS:
        decoder = GpuDecoder(device, method, 1, 3)
        once = decoder.decode(blob, repeat=10).milliseconds.min()
        decoded = decoder.decode(blob, repeat=_repetitions(once))
        if decoded.errors.any():
            raise SystemExit(f"bench vulkan_peers: {model}: {method} failed")
        yield f"ours, {method}", decoded.milliseconds, int(decoded.triangle_counts.sum()), True
    for name, decode in ((MESHOPT, _decode_meshopt), (DGF, _decode_dgf)):
        expected = np.load(folder / f"{model}.{name}.npz")
        milliseconds, same = decode(device, folder, model, expected)
        yield TITLES[name], milliseconds, len(expected["triangles"]), same


def _repetitions(milliseconds: float) -> int:
    return REPEAT + min(int(WARM_UP / milliseconds), 5000)


def _decode_meshopt(device, folder: Path, model: str, expected) -> tuple[np.ndarray, bool]:
    """Milliseconds of meshletdec.slang, and whether its triangles are the CPU's."""
    stream = np.fromfile(folder / f"{model}.{MESHOPT}", np.uint8)
    entries = np.fromfile(folder / f"{model}.{MESHOPT}.meshlets", np.uint32).reshape(-1, 4)
    offset, size, vertices, triangles = entries.T
    # MeshletDesc of the shader; no vertex references are stored.
    words = np.stack(
        [offset, np.cumsum(triangles, dtype=np.uint32) - triangles, size | triangles << 24], axis=1
    )
    first = np.repeat(np.cumsum(vertices) - vertices, triangles)
    local = (expected["triangles"] - first[:, None]).astype(np.uint32)
    run = Run(
        device,
        folder / f"{MESHOPT}.spv",
        [_padded(stream), words, 4 * int(triangles.sum()), np.array([len(entries), 0, 0, 0])],
        uniform=3,
    )
    milliseconds = run.time(-(-len(entries) // MESHOPT_GROUP))
    found = run.buffers[2].read()
    return milliseconds, np.array_equal(found, local @ np.array([1, 1 << 8, 1 << 16]))


def _decode_dgf(device, folder: Path, model: str, expected) -> tuple[np.ndarray, bool]:
    """Milliseconds of dgf_blocks.slang, and whether its triangles and positions are the CPU's.

    On an NVIDIA H200 they are not, probably because the SDK's shader (DGFDecompression.hlsl, 1.0.0)
    shifts by the width and more: HLSL takes that modulo the width, SPIR-V leaves it undefined.
    """
    blocks = np.fromfile(folder / f"{model}.{DGF}", np.uint32).reshape(-1, 32)
    triangles, vertices = ((blocks[:, 0] >> shift & 63) + 1 for shift in (16, 10))
    local = expected["triangles"] - np.repeat(np.cumsum(vertices) - vertices, triangles)[:, None]
    count = DGF_BLOCK * len(blocks)
    run = Run(
        device,
        folder / f"{DGF}.spv",
        [blocks, 4 * count, 12 * count],
    )
    milliseconds = run.time(len(blocks))
    slots = np.arange(DGF_BLOCK)
    found = run.buffers[1].read().reshape(-1, DGF_BLOCK)[slots < triangles[:, None]]
    same = np.array_equal(found, local.astype(np.uint32) @ np.array([1, 1 << 8, 1 << 16]))
    positions = run.buffers[2].read(np.float32).reshape(-1, DGF_BLOCK, 3)
    same &= np.array_equal(positions[slots < vertices[:, None]], expected["positions"])
    return milliseconds, same


def _padded(data: np.ndarray) -> np.ndarray:
    return np.concatenate([data, np.zeros(-len(data) % 4, np.uint8)])


class Run:
    """A compute shader with a buffer at each binding, from 0.

    buffers: the content of each, or its size in bytes. uniform: the binding of a uniform buffer.
    """

    def __init__(self, device, shader: Path, buffers: list, uniform: int = -1):
        from vk_backend import vk
        from vk_backend.memory import ADDRESSED, STORAGE, Buffer

        self.device, self.buffers, kinds = device, [], []
        for binding, content in enumerate(buffers):
            data = b"" if isinstance(content, int) else np.ascontiguousarray(content).tobytes()
            size = content if isinstance(content, int) else len(data)
            usage = vk.VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT | ADDRESSED
            is_uniform = binding == uniform
            self.buffers.append(Buffer(device, size, usage if is_uniform else STORAGE).write(data))
            kinds.append(
                vk.VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER
                if is_uniform
                else vk.VK_DESCRIPTOR_TYPE_STORAGE_BUFFER
            )
        set_layout = self._set_layout(kinds)
        self._set = self._descriptors(set_layout, kinds)
        self._make_pipeline(shader.read_bytes(), set_layout)

    def _set_layout(self, kinds: list[int]):
        from vk_backend import vk

        bindings = [
            vk.VkDescriptorSetLayoutBinding(
                binding=number,
                descriptorType=kind,
                descriptorCount=1,
                stageFlags=vk.VK_SHADER_STAGE_COMPUTE_BIT,
            )
            for number, kind in enumerate(kinds)
        ]
        info = vk.VkDescriptorSetLayoutCreateInfo(bindingCount=len(bindings), pBindings=bindings)
        layout = vk.vkCreateDescriptorSetLayout(self.device.handle, info, None)
        self._at_close(vk.vkDestroyDescriptorSetLayout, layout)
        return layout

    def _descriptors(self, layout, kinds: list[int]):
        """A descriptor set of all buffers."""
        from vk_backend import vk

        sizes = [vk.VkDescriptorPoolSize(type=kind, descriptorCount=1) for kind in kinds]
        info = vk.VkDescriptorPoolCreateInfo(maxSets=1, poolSizeCount=len(sizes), pPoolSizes=sizes)
        pool = vk.vkCreateDescriptorPool(self.device.handle, info, None)
        self._at_close(vk.vkDestroyDescriptorPool, pool)
        allocation = vk.VkDescriptorSetAllocateInfo(
            descriptorPool=pool, descriptorSetCount=1, pSetLayouts=[layout]
        )
        (made,) = vk.vkAllocateDescriptorSets(self.device.handle, allocation)
        whole = [
            vk.VkDescriptorBufferInfo(buffer=buffer.handle, offset=0, range=max(buffer.size, 4))
            for buffer in self.buffers
        ]
        writes = [
            vk.VkWriteDescriptorSet(
                dstSet=made,
                dstBinding=number,
                descriptorCount=1,
                descriptorType=kind,
                pBufferInfo=[whole[number]],
            )
            for number, kind in enumerate(kinds)
        ]
        vk.vkUpdateDescriptorSets(self.device.handle, len(writes), writes, 0, None)
        return made

    def _make_pipeline(self, code: bytes, set_layout) -> None:
        from vk_backend import vk
        from vk_backend.pipelines import pipeline_layout

        handle = self.device.handle
        self._layout = pipeline_layout(self.device, [set_layout])
        module = vk.vkCreateShaderModule(
            handle, vk.VkShaderModuleCreateInfo(codeSize=len(code), pCode=code), None
        )
        self._at_close(vk.vkDestroyShaderModule, module)
        stage = vk.VkPipelineShaderStageCreateInfo(
            stage=vk.VK_SHADER_STAGE_COMPUTE_BIT, module=module, pName="main"
        )
        info = vk.VkComputePipelineCreateInfo(stage=stage, layout=self._layout)
        (self._pipeline,) = vk.vkCreateComputePipelines(handle, None, 1, [info], None)
        self._at_close(vk.vkDestroyPipeline, self._pipeline)

    def _at_close(self, destroy, made) -> None:
        self.device.at_close(lambda: destroy(self.device.handle, made, None))

    def time(self, groups: int) -> np.ndarray:
        """float64[repetitions]: milliseconds of each run of so many workgroups."""
        return self._run(groups, _repetitions(self._run(groups, 10).min()))

    def _run(self, groups: int, repeat: int) -> np.ndarray:
        from vk_backend import vk
        from vk_backend.pipelines import Timestamps

        times, point = Timestamps(self.device, repeat + 1), vk.VK_PIPELINE_BIND_POINT_COMPUTE
        with self.device.commands() as commands:
            vk.vkCmdBindPipeline(commands, point, self._pipeline)
            vk.vkCmdBindDescriptorSets(commands, point, self._layout, 0, 1, [self._set], 0, None)
            times.reset(commands)
            times.mark(commands, 0)
            for i in range(repeat):
                vk.vkCmdDispatch(commands, min(groups, ROW), -(-groups // ROW), 1)
                self.device.compute_barrier(commands)
                times.mark(commands, i + 1)
        return times.milliseconds()


# --- the page ---


def summary(result: dict) -> str:
    """Billion triangles per second by model and format; "wrong" if they differ from the CPU's."""
    names = list(dict.fromkeys(row["format"] for row in result["rows"]))
    models = list(dict.fromkeys(row["model"] for row in result["rows"]))
    rates = {
        (row["model"], row["format"]): row["triangles_per_second"] / 1e9
        for row in result["rows"]
        if row["same"]
    }
    wrong = {(row["model"], row["format"]) for row in result["rows"]} - set(rates)
    cells = []
    for model in models:
        own = best_in_bold([rates.get((model, name)) for name in names], ".2f")
        cells.append([model, *("wrong" if (model, n) in wrong else c for n, c in zip(names, own))])
    return markdown_table(["model", *names], cells)


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, help="of the prepared models and shaders")
    parser.add_argument(
        "--prepare", nargs="+", type=Path, metavar="FILE", help="models to prepare; measure nothing"
    )
    parser.add_argument("--device", help="number or part of the name (default: the first GPU)")
