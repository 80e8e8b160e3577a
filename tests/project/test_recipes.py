"""packaging/: the recipes build the package from an archive of the commit, as their tools would."""

import hashlib
import json
import re
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

from tests.helpers.environment import ROOT, need_package
from tools import build_wheels, release
from tools.native_build import find_cmake

PACKAGING = ROOT / "packaging"
CONSUMER = ROOT / "tests" / "codec" / "package"
SMALL = ROOT / "spec" / "vectors" / "valid_group_tables.bin"
# Stand-ins for vcpkg's functions: the archive of the commit, and one configuration.
VCPKG = """
set(CURRENT_PACKAGES_DIR "{prefix}")
function(vcpkg_from_github)
  cmake_parse_arguments(PARSE_ARGV 0 given "" "OUT_SOURCE_PATH;REPO;REF;SHA512;HEAD_REF" "")
  if(NOT given_REF STREQUAL "v{version}" OR given_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "unknown arguments: ${{given_REF}} ${{given_UNPARSED_ARGUMENTS}}")
  endif()
  set(${{given_OUT_SOURCE_PATH}} "{source}" PARENT_SCOPE)
endfunction()
function(run)
  execute_process(COMMAND ${{ARGV}} COMMAND_ERROR_IS_FATAL ANY)
endfunction()
function(vcpkg_cmake_configure)
  cmake_parse_arguments(PARSE_ARGV 0 given "" "SOURCE_PATH" "OPTIONS")
  run("{cmake}" -S "${{given_SOURCE_PATH}}" -B "{build}" -DBUILD_SHARED_LIBS={shared}
      "-DCMAKE_INSTALL_PREFIX={prefix}" -DCMAKE_INSTALL_LIBDIR=lib ${{given_OPTIONS}})
endfunction()
function(vcpkg_cmake_install)
  run("{cmake}" --build "{build}" --parallel 2)
  run("{cmake}" --install "{build}")
endfunction()
function(vcpkg_cmake_config_fixup)
  cmake_parse_arguments(PARSE_ARGV 0 given "" "PACKAGE_NAME;CONFIG_PATH" "")
  if(NOT EXISTS "{prefix}/${{given_CONFIG_PATH}}/${{given_PACKAGE_NAME}}-config.cmake")
    message(FATAL_ERROR "no CMake package in ${{given_CONFIG_PATH}}")
  endif()
endfunction()
function(vcpkg_fixup_pkgconfig)
endfunction()
function(vcpkg_install_copyright)
  cmake_parse_arguments(PARSE_ARGV 0 given "" "" "FILE_LIST")
  file(INSTALL ${{given_FILE_LIST}} DESTINATION "{prefix}/share/gltf-meshlet")
endfunction()
set(VERSION {version})
include("{portfile}")
"""


def run(*command, **options):
    result = subprocess.run(command, capture_output=True, text=True, **options)
    assert result.returncode == 0, result.stdout[-3000:] + result.stderr[-3000:]
    return result.stdout


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    """What GitHub would give for a tag: the commit's files below one folder."""
    path = tmp_path_factory.mktemp("archive") / "v.tar.gz"
    prefix = "--prefix=gltf-meshlet-1/"
    run("git", "archive", "--format=tar.gz", prefix, "-o", path, "HEAD", cwd=ROOT)
    return path


def libraries(folder):
    names = {path.name for path in Path(folder).rglob("libgltf_meshlet.*")}
    return sorted(name for name in names if re.search(r"\.(a|so)$", name))


@pytest.mark.full
@pytest.mark.parametrize("shared", [True, False])
def test_conan_recipe(shared, archive, tmp_path, monkeypatch):
    """`conan create` with this machine's compiler runs the program of test_package."""
    need_package("conan")
    conan = Path(sys.executable).with_name("conan")
    monkeypatch.setenv("CONAN_HOME", str(tmp_path / "home"))
    recipe = tmp_path / "recipe"
    shutil.copytree(PACKAGING / "conan", recipe)
    digest = hashlib.sha256(archive.read_bytes()).hexdigest()
    data = (recipe / "conandata.yml").read_text()
    data = re.sub(r'url: ".*"', f'url: "{archive.as_uri()}"', data)
    (recipe / "conandata.yml").write_text(re.sub(r'sha256: ".*"', f'sha256: "{digest}"', data))
    version = release.version_in("packaging/conan/conandata.yml")
    run(conan, "profile", "detect")
    options = ("-o", f"&:shared={shared}", "-s", "compiler.cppstd=17")
    output = run(conan, "create", recipe, "--version", version, *options, "-f", "json")
    assert json.loads(output)["graph"]
    (package,) = (tmp_path / "home" / "p" / "b").glob("*/p")
    assert libraries(package) == ["libgltf_meshlet.so" if shared else "libgltf_meshlet.a"]
    assert (package / "licenses" / "LICENSE").exists()


@pytest.mark.full
@pytest.mark.parametrize("shared", ["ON", "OFF"])
def test_vcpkg_port(shared, archive, tmp_path):
    """The port's steps with stand-ins for vcpkg's functions; then a program uses the package."""
    with tarfile.open(archive) as files:
        files.extractall(tmp_path, filter="data")
    prefix, cmake = tmp_path / "prefix", find_cmake()
    script = VCPKG.format(
        build=tmp_path / "build",
        cmake=cmake,
        portfile=PACKAGING / "vcpkg" / "portfile.cmake",
        prefix=prefix,
        shared=shared,
        source=tmp_path / "gltf-meshlet-1",
        version=json.loads((PACKAGING / "vcpkg" / "vcpkg.json").read_text())["version"],
    )
    (tmp_path / "port.cmake").write_text(script)
    run(cmake, "-P", tmp_path / "port.cmake")
    assert libraries(prefix) == ["libgltf_meshlet.so" if shared == "ON" else "libgltf_meshlet.a"]
    assert (prefix / "share" / "gltf-meshlet" / "LICENSE").exists()
    library = "gltf_meshlet::gltf_meshlet" if shared == "ON" else "gltf_meshlet::static"
    program = tmp_path / "program"
    options = (f"-DCMAKE_PREFIX_PATH={prefix}", f"-DLIBRARY={library}")
    run(cmake, "-S", CONSUMER, "-B", program, *options)
    run(cmake, "--build", program)
    assert "triangles, " in run(program / "count", SMALL)


def test_conda_recipe_needs_what_the_package_needs():
    """Its requirements are those of pyproject.toml. conda-forge's own packages are not here."""
    recipe = (PACKAGING / "conda" / "recipe.yaml").read_text()
    needed = re.search(r"^dependencies = \[\n(.*?)^\]", _project(), re.M | re.S)[1]
    names = sorted({re.match(r"[\w-]+", text)[0] for text in re.findall(r'"([^"]+)"', needed)})
    run_section = re.search(r"^  run:\n((?:    - .*\n)+)", recipe, re.M)[1]
    assert sorted([*names, "python"]) == re.findall(r"- ([\w-]+)", run_section)
    for requirement in ("numpy >=1.25", "pygltflib >=1.16", "python >=3.10"):
        assert requirement in recipe and requirement.replace(" ", "") in f"{_project()}python>=3.10"


@pytest.mark.parametrize("platform", ["linux-64", "linux-aarch64", "osx-arm64"])
def test_conda_recipe_renders(platform):
    """As rattler-build reads it, with names of compilers as conda-forge sets them."""
    rattler_build = need_package("rattler_build")
    text = (PACKAGING / "conda" / "recipe.yaml").read_text()
    compilers = rattler_build.VariantConfig({"c_stdlib": ["sysroot"], "cxx_compiler": ["gxx"]})
    target = rattler_build.PlatformConfig(target_platform=platform)
    settings = rattler_build.RenderConfig(platform=target)
    (rendered,) = rattler_build.Stage0Recipe.from_yaml(text).render(compilers, settings)
    package = rendered.recipe.package
    version = release.version_in("packaging/conda/recipe.yaml")
    assert (package.name, package.version) == ("gltf-meshlet", version)
    assert "scikit-build-core >=0.10" in rendered.recipe.to_dict()["requirements"]["host"]


def test_container_has_what_the_build_needs():
    """Its context is a list, which a new folder of the build must join."""
    listed = (PACKAGING / "container" / "Dockerfile.dockerignore").read_text()
    packages = re.search(r"^wheel\.packages = \[(.*)\]", _project(), re.M)[1]
    for name in (*re.findall(r'"(\w+)"', packages), "codec", "cmake", "tools/build_backend.py"):
        assert f"!{name}\n" in listed


def _project():
    return (ROOT / "pyproject.toml").read_text()


@pytest.mark.full
def test_readme_s_commands_run_with_the_wheel(tmp_path):
    """In an empty environment, by the tool with which workflows try the wheels of all platforms."""
    tag = "manylinux_2_17_x86_64"
    assert build_wheels.main(["--only", tag]) == 0
    tool = ROOT / "tools" / "try_wheel.py"
    output = run(sys.executable, tool, ROOT / "dist", tag, cwd=tmp_path)
    assert "left out" not in output and "s: gltf-meshlet gpu-check" in output
