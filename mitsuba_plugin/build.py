"""Compiles the plugin's native library on first use and keeps it in the user's cache folder.

`import mitsuba_plugin` does this by itself; `python mitsuba_plugin/build.py` does it ahead of time.
The library cannot be part of a wheel: it is compiled against the C++ classes of one Mitsuba.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.metadata
import importlib.util
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from itertools import takewhile
from pathlib import Path
from typing import NoReturn, TextIO

from gltf_ext.files import cache_folder
from gltf_ext.progress import progress_bar

LIBRARY = "meshlet_edgebreaker.so"
HERE = Path(__file__).resolve().parent
EXTRA = "pip install 'gltf-meshlet[mitsuba]'"
HASWELL = {"avx2", "bmi1", "bmi2", "fma"}  # Mitsuba's wheel is compiled for these
KEPT = 4  # libraries per Mitsuba and Python; each edit of the C++ sources makes one of about 1 MB

# Messages of this process's failed compilations: importing again must not compile again.
_failed: dict[Path, str] = {}


def library() -> Path:
    """The native library for this Python and its Mitsuba; compiles it if the cache has none.

    Raises ImportError with one line: what is missing, or the compiler's error and the log's path.
    """
    environment = _environment()
    cache = cache_folder()
    path = cache / f"{environment}-{_digest()}" / LIBRARY
    if path.is_file():
        with contextlib.suppress(OSError):
            os.utime(path)  # _prune() removes the least recently used
        return path
    if path in _failed:
        raise ImportError(_failed[path])
    try:
        cache.mkdir(parents=True, exist_ok=True)
        _compile_once(path, environment)
    except ImportError as error:
        _failed[path] = str(error)
        raise
    except OSError as error:
        raise ImportError(
            f"cannot write the Mitsuba plugin's library: {error}; "
            "set XDG_CACHE_HOME to a folder that is writable"
        ) from None
    return path


def _environment() -> str:
    """Versions that the library's binary interface depends on, as a file name."""
    try:
        versions = [f"{name}-{importlib.metadata.version(name)}" for name in ("mitsuba", "drjit")]
    except importlib.metadata.PackageNotFoundError as error:
        raise ImportError(f"{error.name} is not installed; {EXTRA}") from None
    return "-".join([*versions, str(sys.implementation.cache_tag), platform.machine()])


def _digest() -> str:
    """SHA-256 of the sources' names and contents, 16 hexadecimal digits."""
    total = hashlib.sha256()
    for name, path in sorted(_sources().items()):
        total.update(f"{name}\0{path.stat().st_size}\0".encode())
        total.update(path.read_bytes())
    return total.hexdigest()[:16]


def _sources() -> dict[str, Path]:
    """Everything that the library is compiled from; names are alike in a wheel and a checkout."""
    codec = _codec()
    files = [HERE / "CMakeLists.txt", *(HERE / "src").iterdir()]
    found = {f"plugin/{path.name}": path for path in files}
    for path in (codec / "CMakeLists.txt", *codec.glob("*/*")):
        if path.suffix in (".h", ".cpp", ".glsl", ".txt"):
            name = path.relative_to(codec).as_posix()
            if not name.startswith("c/"):  # a wheel lacks it
                found[f"codec/{name}"] = path
    return found


def _codec() -> Path:
    """The codec's sources: inside the package in a wheel, beside it in a checkout."""
    packaged = HERE / "codec"
    return packaged if packaged.is_dir() else HERE.parent / "codec"


def _compile_once(path: Path, environment: str) -> None:
    """Compiles to `path`; of concurrent processes, one compiles and the others wait for it."""
    checkout = _codec().parent != HERE and os.access(HERE.parent, os.W_OK)
    # A checkout keeps its object files: after an edit only the changed ones are compiled.
    folder = HERE.parent / "build" / "mitsuba" / environment if checkout else path.parent / "build"
    folder.mkdir(parents=True, exist_ok=True)
    with _locked(folder.with_name(f"{folder.name}.lock")):
        if path.is_file():
            return
        _check_machine()
        version = importlib.metadata.version("mitsuba")
        _say(f"compiling the Mitsuba plugin for Mitsuba {version}, once; this takes about a minute")
        with progress_bar("Mitsuba plugin", True) as advance:
            built = _compile(folder, advance)
        _publish(built, path)
        if not checkout:
            shutil.rmtree(folder, ignore_errors=True)
        _prune(environment)


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    if sys.platform == "win32":
        raise ImportError("the Mitsuba plugin runs on Linux only")
    import fcntl  # which Windows lacks

    with path.open("w", encoding="utf-8") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            _say("waiting for another process, which compiles the Mitsuba plugin")
            fcntl.flock(file, fcntl.LOCK_EX)
        yield  # closing the file unlocks it


def _publish(built: Path, path: Path) -> None:
    """Copies, then renames: a reader finds the whole library or none."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent)
    os.close(handle)
    shutil.copy(built, temporary)
    os.replace(temporary, path)


def _prune(environment: str) -> None:
    """Removes all but the most recently used libraries of this Mitsuba and Python."""
    found = cache_folder().glob(f"{environment}-*/{LIBRARY}")
    for path in sorted(found, key=lambda path: path.stat().st_mtime)[:-KEPT]:
        shutil.rmtree(path.parent, ignore_errors=True)


def _check_machine() -> None:
    """Raises ImportError if the compilation cannot succeed here."""
    if platform.machine() not in ("x86_64", "AMD64"):
        _fail(f"it needs an x86-64 processor, this is {platform.machine()}")
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists() and not HASWELL.issubset(cpuinfo.read_text(encoding="utf-8").split()):
        _fail("it needs a processor with AVX2")
    if importlib.util.find_spec("nanobind") is None:
        _fail(f"nanobind is not installed; {EXTRA}")
    if not _has_program("cmake"):
        _fail(f"cmake is not installed; {EXTRA}")
    if not os.environ.get("CXX") and not any(map(_has_program, ("c++", "g++", "clang++"))):
        _fail("there is no C++ compiler; install GCC 12 or newer (Debian: apt install g++)")


def _fail(reason: str) -> NoReturn:
    raise ImportError(f"the Mitsuba plugin cannot be compiled: {reason}")


def _has_program(name: str) -> bool:
    return shutil.which(name, path=_path()) is not None


def _path() -> str:
    """PATH, after the programs that pip installed beside this Python."""
    return os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])


def _compile(folder: Path, advance: Callable[[float], None] | None) -> Path:
    """Configures and compiles in `folder`; returns the library. Raises ImportError."""
    configure = ["cmake", "-S", str(HERE), "-B", str(folder)]
    configure += ["-G", "Ninja"] if _has_program("ninja") else []
    configure += [f"-DPython_EXECUTABLE={sys.executable}"]
    build = ["cmake", "--build", str(folder), "--parallel", str(os.cpu_count() or 1)]
    log = folder / "build.log"
    with log.open("w", encoding="utf-8") as output:
        built = _run(configure, output) and _run(build, output, advance)
    if not built:
        # CMake would keep the compiler that it found, also if CXX names another one next time.
        (folder / "CMakeCache.txt").unlink(missing_ok=True)
        cause = _cause(log.read_text(encoding="utf-8", errors="replace"))
        _fail(f"{cause}; it needs GCC 12 or newer; log: {log}")
    return folder / LIBRARY


def _run(
    command: Sequence[str],
    output: TextIO,
    advance: Callable[[float], None] | None = None,
) -> bool:
    """Runs a command, its output into the log; True if it succeeds."""
    environment = {**os.environ, "PATH": _path()}
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=environment
    ) as process:
        assert process.stdout is not None
        for data in process.stdout:
            line = data.decode(errors="replace")
            output.write(line)
            step = re.match(r"\[(\d+)/(\d+)\]", line)  # Ninja's
            if step and advance:
                advance(int(step[1]) / int(step[2]))
    return process.returncode == 0


def _cause(log: str) -> str:
    """The log's first error, at most 200 characters."""
    lines = log.splitlines()
    for i, line in enumerate(lines):
        if line.startswith("CMake Error"):  # the message follows, indented
            message = takewhile(lambda text: not text or text[0] == " ", lines[i + 1 :])
            return " ".join(" ".join(message).split())[:200]
        if re.search(r"\berror\b", line, re.IGNORECASE):
            return line.strip()[:200]
    return "no error in the log"


def _say(text: str) -> None:
    print(f"gltf-meshlet: {text}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    try:
        library()
    except ImportError as error:
        sys.exit(f"gltf-meshlet: {error}")
