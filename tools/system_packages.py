#!/usr/bin/env python3
"""Installs system packages: LLVM, a Vulkan driver with mesh shaders, shader tools, headers.

With the argument "browsers": those for tests of the npm package in browsers; "platforms": those
that run programs of other platforms. The Makefile calls this. As root on Debian or Ubuntu it says
which packages are missing and where they come from, and installs them; elsewhere it names them in
one line. It never replaces a GPU driver. GLTF_MESHLET_SYSTEM_PACKAGES=no installs nothing; =yes
also lets it add a source of packages while it installs. The exit status is always 0: everything
else works without these packages.
"""

import ctypes.util
import os
import re
import shutil
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

VARIABLE = "GLTF_MESHLET_SYSTEM_PACKAGES"
AGAIN = f"{VARIABLE}=yes .venv/bin/python tools/system_packages.py"
LEAST_LLVM = 17  # older versions abort on code that Dr.Jit generates
DRIVER = "mesa-vulkan-drivers"  # contains lavapipe, Vulkan on the CPU
BACKPORTS = {"bookworm": "bookworm-backports"}  # releases whose Mesa lacks mesh shaders
LAYERS = (
    "/usr/share/vulkan/explicit_layer.d",
    "/usr/local/share/vulkan/explicit_layer.d",
    "/etc/vulkan/explicit_layer.d",
)
# Program -> Debian's package.
BROWSERS = {
    "chromium": "chromium",
    "firefox-esr": "firefox-esr",
    "xvfb-run": "xvfb",
    "xauth": "xauth",
}
PLATFORMS = {"wine": "wine", "qemu-aarch64": "qemu-user", "ld-musl-config": "musl"}
KEYRING = Path("/usr/share/keyrings/debian-archive-keyring.gpg")
SOURCES = Path("/etc/apt/sources.list.d/gltf-meshlet-temporary.list")
# A network that does not answer must not stop the build.
UPDATE_SECONDS = 120
DOWNLOAD_SECONDS = 600
APT = ("apt-get", "-qq", "-y", "--no-install-recommends", "-o", "DPkg::Lock::Timeout=60",
       "-o", "Acquire::Retries=1", "-o", "Acquire::http::Timeout=20")  # fmt: skip


def main() -> None:
    kinds = {
        "": (missing, "some renderers and tests"),
        "browsers": (lambda: missing_programs(BROWSERS), "tests in browsers"),
        "platforms": (lambda: missing_programs(PLATFORMS), "tests of other platforms"),
    }
    find, need = kinds[" ".join(sys.argv[1:])]
    packages = find()
    if not packages:
        return
    hint = f"apt install {' '.join(packages)}"
    wish = os.environ.get(VARIABLE) or "unset"
    if wish not in ("yes", "no", "unset"):
        say(f"{VARIABLE} is {wish!r}; use yes or no; it counts as no")
    if wish not in ("yes", "unset") or os.geteuid() != 0 or not shutil.which("apt-get"):
        say(f"{need} lack system packages and are skipped; Debian: {hint}")
        return
    try:
        install(packages, may_add_source=wish == "yes")
    except (subprocess.SubprocessError, OSError) as error:
        say(
            f"cannot install system packages ({reason(error)}); {need} lack them "
            f"and are skipped; try: {hint}"
        )


def say(text: str) -> None:
    print(f"make: {text}", flush=True)


# --- finding missing packages ---


def missing() -> list[str]:
    """Debian's names of the packages that this machine lacks."""
    packages = [] if has_llvm() else ["libllvm19"]
    packages += [
        p
        for p, tool in (("glslang-tools", "glslangValidator"), ("spirv-tools", "spirv-val"))
        if not shutil.which(tool)
    ]
    if not any(Path(folder, "VkLayer_khronos_validation.json").exists() for folder in LAYERS):
        packages.append("vulkan-validationlayers")
    if ctypes.util.find_library("vulkan") is None:
        packages.append("libvulkan1")
    if not has_vulkan_driver():
        packages.append(DRIVER)
    # For examples/; Debian's tinygltf includes nlohmann-json without depending on it.
    headers = {
        "tiny_gltf.h": "libtinygltf-dev",
        "nlohmann/json.hpp": "nlohmann-json3-dev",
        "vulkan/vulkan.h": "libvulkan-dev",
    }
    packages += [p for header, p in headers.items() if not Path("/usr/include", header).exists()]
    return packages


def missing_programs(packages: dict[str, str]) -> list[str]:
    """The packages of the programs that this machine lacks."""
    return [package for program, package in packages.items() if not shutil.which(program)]


def has_llvm() -> bool:
    """True if an LLVM that Dr.Jit can use is installed."""
    folders = (Path("/usr/lib"), Path("/usr/lib64"), *Path("/usr/lib").glob("*-linux-gnu"))
    names = (library.name for folder in folders for library in folder.glob("libLLVM*.so.*"))
    versions = (re.match(r"libLLVM(?:-(\d+)\.so|\.so\.(\d+))", name) for name in names)
    return any(int(version[1] or version[2]) >= LEAST_LLVM for version in versions if version)


def has_vulkan_driver() -> bool:
    """True with any GPU, whose driver is the user's choice, or a CPU device with mesh shaders."""
    if Path("/proc/driver/nvidia").exists():
        return True
    try:
        import vulkan as vk
    except OSError:  # no Vulkan loader
        return False
    except ImportError:  # without the Python package a driver is of no use
        return True
    try:
        application = vk.VkApplicationInfo(
            pApplicationName="gltf-meshlet", apiVersion=vk.VK_MAKE_VERSION(1, 3, 0)
        )
        instance = vk.vkCreateInstance(vk.VkInstanceCreateInfo(pApplicationInfo=application), None)
        devices = vk.vkEnumeratePhysicalDevices(instance)
    except vk.VkError:
        return False
    return any(is_gpu(vk, device) or has_mesh_shaders(vk, device) for device in devices)


def is_gpu(vk, device) -> bool:
    return vk.vkGetPhysicalDeviceProperties(device).deviceType != vk.VK_PHYSICAL_DEVICE_TYPE_CPU


def has_mesh_shaders(vk, device) -> bool:
    extensions = vk.vkEnumerateDeviceExtensionProperties(device, None)
    return "VK_EXT_mesh_shader" in {extension.extensionName for extension in extensions}


# --- installing ---


def install(packages: list[str], may_add_source: bool) -> None:
    """Says what it installs from where, then does it."""
    release = BACKPORTS.get(codename()) if DRIVER in packages else None
    known = known_releases()
    source = source_of(release) if release and release not in known else None
    if source and not may_add_source:
        say(
            f"{DRIVER} with mesh shaders is in {release}, which is none of apt's sources; tests "
            f"that need it are skipped; to add that source while it is installed: {AGAIN}"
        )
        packages, release, source = [p for p in packages if p != DRIVER], None, None
    if not packages:
        return
    places = ", ".join(sorted(set(known.values()))) or "apt's sources"
    added = f" and, only while they are installed, {source.strip()!r}" if source else ""
    say(f"installing {' '.join(packages)} from {places}{added}; to decline, set {VARIABLE}=no")
    plain = [package for package in packages if package != DRIVER or not release]
    with temporary_source(source):
        apt("update", seconds=UPDATE_SECONDS)
        if plain:
            apt_install(plain)
        if release:
            apt_install(["-t", release, DRIVER])


def apt_install(arguments: list[str]) -> None:
    # Only the download has a timeout: interrupting the unpacking would break the system.
    apt("install", "--download-only", *arguments, seconds=DOWNLOAD_SECONDS)
    apt("install", *arguments, seconds=None)


def apt(*arguments: str, seconds: int | None) -> None:
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    subprocess.run(
        [*APT, *arguments],
        check=True,
        capture_output=True,
        text=True,
        timeout=seconds,
        env=environment,
    )


def codename() -> str:
    text = Path("/etc/os-release").read_text()
    found = re.search(r'^VERSION_CODENAME="?([^"\n]*)', text, re.M)
    return found[1] if found else ""


def known_releases() -> dict[str, str]:
    """Codename -> mirror of apt's sources."""
    lines = subprocess.run(
        ["apt-get", "indextargets", "--format", "$(CODENAME) $(REPO_URI)"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.splitlines()
    return dict(line.split() for line in reversed(lines))


def source_of(release: str) -> str | None:
    """The line for apt of a release on apt's own mirror; None without such a mirror."""
    mirror = known_releases().get(codename())
    signed = f"[signed-by={KEYRING}] " if KEYRING.exists() else ""
    return f"deb {signed}{mirror} {release} main\n" if mirror else None


@contextmanager
def temporary_source(source: str | None):
    """Adds a line to apt's sources for the duration."""
    if source is None:
        yield
        return
    SOURCES.write_text(source)
    try:
        yield
    finally:
        SOURCES.unlink()


def reason(error: Exception) -> str:
    """The error in one line."""
    if isinstance(error, subprocess.TimeoutExpired):
        return f"no answer for {error.timeout:.0f} s"
    lines = (getattr(error, "stderr", None) or str(error)).strip().splitlines()
    return lines[-1] if lines else type(error).__name__


if __name__ == "__main__":
    sys.exit(main())
