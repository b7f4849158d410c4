# SPDX-License-Identifier: MIT
"""The wheel: CMake builds the module, setuptools packs it."""

import os
import pathlib
import re
import shutil
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

SOURCE = pathlib.Path(__file__).resolve().parent.parent
VERSION = re.search(r"project\(holdfast VERSION ([0-9.]+)", (SOURCE / "CMakeLists.txt").read_text())[1]


class CMakeBuild(build_ext):
    def build_extension(self, ext):
        folder = os.environ.get("HOLDFAST_BUILD_DIR") or str(pathlib.Path(self.build_temp).resolve())
        subprocess.run(
            ["cmake", "-S", str(SOURCE), "-B", folder, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
             "-DHOLDFAST_BUILD_PYTHON=ON", f"-DPython3_EXECUTABLE={sys.executable}"], check=True)
        subprocess.run(["cmake", "--build", folder, "--target", "holdfast_python"], check=True)
        built = pathlib.Path(self.get_ext_fullpath(ext.name))
        built.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(pathlib.Path(folder) / "python" / "holdfast" / built.name, built)
        subprocess.run(["strip", "--strip-unneeded", str(built)], check=True)


setup(version=VERSION, ext_modules=[Extension("holdfast._core", sources=[])],
      cmdclass={"build_ext": CMakeBuild})
