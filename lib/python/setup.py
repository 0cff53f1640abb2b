"""Builds the compiled module with CMake and puts it beside the package's Python files."""

import os
import re
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parents[2]


def version() -> str:
    found = re.search(r"project\(tangible VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text())
    if found is None:
        raise SystemExit(f"{ROOT / 'CMakeLists.txt'}: no version")
    return found.group(1)


class CMakeBuild(build_ext):
    def build_extension(self, extension: Extension) -> None:
        target = Path(self.get_ext_fullpath(extension.name)).resolve().parent
        build = Path(self.build_temp).resolve()
        build.mkdir(parents=True, exist_ok=True)
        generator = ["-G", "Ninja"] if subprocess.run(["which", "ninja"], stdout=subprocess.DEVNULL).returncode == 0 else []
        subprocess.run(
            [
                "cmake", "-S", str(ROOT), "-B", str(build), *generator,
                "-DCMAKE_BUILD_TYPE=Release", "-DTANGIBLE_PYTHON=ON", "-DTANGIBLE_BUILD_TESTS=OFF",
                "-DTANGIBLE_BUILD_BENCHMARKS=OFF", "-DTANGIBLE_PRECOMPILE_HEADERS=ON",
                f"-DPython3_EXECUTABLE={sys.executable}", f"-DTANGIBLE_PYTHON_DESTINATION={target}",
            ],
            check=True,
        )
        jobs = str(os.cpu_count() or 1)
        subprocess.run(
            ["cmake", "--build", str(build), "--target", "tangible_python", "--parallel", jobs], check=True
        )
        subprocess.run(["cmake", "--install", str(build), "--component", "python"], check=True)


# What is built stands where all else is, and not among the sources.
BUILD = ROOT / "build" / "wheel"
BUILD.mkdir(parents=True, exist_ok=True)

setup(
    options={"build": {"build_base": str(BUILD)}, "egg_info": {"egg_base": str(BUILD)}},
    version=version(),
    ext_modules=[Extension("tangible._core", sources=[])],
    cmdclass={"build_ext": CMakeBuild},
)
