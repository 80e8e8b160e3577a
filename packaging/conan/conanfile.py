"""The C interface of the codec for Conan 2: conan create . --version VERSION."""

from conan import ConanFile
from conan.errors import ConanInvalidConfiguration
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeToolchain, cmake_layout
from conan.tools.files import copy, get, rmdir


class GltfMeshlet(ConanFile):
    name = "gltf-meshlet"
    description = "Compresses triangle meshlets for glTF so that each decodes alone"
    license = "MIT"
    url = "https://github.com/OWNER/gltf-meshlet"
    homepage = "https://OWNER.github.io/gltf-meshlet/"
    topics = ("gltf", "meshlet", "mesh-compression")
    package_type = "library"
    settings = "os", "arch", "compiler", "build_type"
    options = {"shared": [True, False], "fPIC": [True, False]}
    default_options = {"shared": False, "fPIC": True}
    implements = ["auto_shared_fpic"]

    def validate(self):
        check_min_cppstd(self, 17)
        if self.settings.compiler == "msvc":
            raise ConanInvalidConfiguration("the decoder uses vector types of GCC and Clang")

    def layout(self):
        cmake_layout(self, src_folder="src")

    def source(self):
        get(self, **self.conan_data["sources"][self.version], strip_root=True)

    def generate(self):
        CMakeToolchain(self).generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        copy(self, "LICENSE", self.source_folder, f"{self.package_folder}/licenses")
        CMake(self).install()
        # Conan writes these for its users.
        rmdir(self, f"{self.package_folder}/lib/cmake")
        rmdir(self, f"{self.package_folder}/lib/pkgconfig")
        rmdir(self, f"{self.package_folder}/share")

    def package_info(self):
        self.cpp_info.libs = ["gltf_meshlet"]
        self.cpp_info.set_property("cmake_file_name", "gltf_meshlet")
        target = "gltf_meshlet" if self.options.shared else "static"
        self.cpp_info.set_property("cmake_target_name", f"gltf_meshlet::{target}")
        self.cpp_info.set_property("pkg_config_name", "gltf_meshlet")
        if not self.options.shared:
            self.cpp_info.defines = ["GLTF_MESHLET_STATIC"]
            if self.settings.os in ("Linux", "FreeBSD"):
                self.cpp_info.system_libs = ["pthread", "m"]
