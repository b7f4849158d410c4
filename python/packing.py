# SPDX-License-Identifier: MIT
"""Builds the wheel with CMake: a build backend (PEP 517) that needs nothing from an index.

In the environment: HOLDFAST_BUILD_DIR, a build folder to go on with; HOLDFAST_WHEEL_PYTHONS, include
folders .../include/python3.X, separated by ';': the wheel then serves these Pythons and brings the
libraries that it uses (needs patchelf). Otherwise it serves this Python on this machine."""

import base64
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
# What every Linux with glibc has (PEP 600), and its loader.
SYSTEM = re.compile(r"(ld-linux.*|lib(c|m|dl|rt|pthread|util|gcc_s|stdc\+\+))\.so\.\d+$")
LICENSE_NOTE = """The sources of Holdfast are under the MIT license. The binaries in this wheel contain CGAL and
link to GLPK, both under the GNU General Public License, version 3 or later: the wheel as a
whole is distributed under that license.
"""


def version():
    return re.search(r"project\(holdfast VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text())[1]


def metadata():
    """METADATA of pyproject.toml, which Python reads by itself only from 3.11 on."""
    text = (ROOT / "pyproject.toml").read_text()
    field = lambda name: re.search(rf'^{name} = "(.*)"', text, re.M)[1]  # noqa: E731
    lines = ["Metadata-Version: 2.1", "Name: holdfast", f"Version: {version()}", f"Summary: {field('description')}",
             f"Requires-Python: {field('requires-python')}", "License: " + re.search(r'license = \{ text = "(.*)"', text)[1]]
    lines += ["Classifier: " + name for name in re.findall(r'^  "(.* :: .*)",', text, re.M)]
    lines += ["Requires-Dist: " + name for name in re.findall(r'"(.*?)"', re.search(r"^dependencies = \[(.*)\]", text, re.M)[1])]
    for extra, names in re.findall(r"^(\w+) = \[(.*)\]", text.split("[project.optional-dependencies]")[1], re.M):
        lines += [f"Provides-Extra: {extra}"]
        lines += [f'Requires-Dist: {name} ; extra == "{extra}"' for name in re.findall(r'"(.*?)"', names)]
    return "\n".join(lines) + "\nDescription-Content-Type: text/markdown\n\n" + (ROOT / "README.md").read_text()


def run(*command):
    subprocess.run([str(part) for part in command], check=True, stdout=sys.stderr)


def read(*command):
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout


def built(folder, pythons):
    """Builds and returns the modules, and the library that they share (None for one of its own)."""
    options = ["-DCMAKE_BUILD_TYPE=Release", "-DHOLDFAST_BUILD_PYTHON=ON", f"-DPython3_EXECUTABLE={sys.executable}"]
    if pythons:
        options += ["-DHOLDFAST_BUILD_SHARED=ON", f"-DHOLDFAST_WHEEL_PYTHONS={pythons}"]
    if not (folder / "CMakeCache.txt").exists():
        options += ["-DHOLDFAST_BUILD_TESTS=OFF", "-DHOLDFAST_BUILD_APPS=OFF", "-G", "Ninja"]
    run("cmake", "-S", ROOT, "-B", folder, *options)
    jobs = ["-j", os.environ["JOBS"]] if "JOBS" in os.environ else []
    run("cmake", "--build", folder, "--target", "holdfast_wheel" if pythons else "holdfast_python", *jobs)
    if not pythons:
        suffix = sysconfig.get_config_var("EXT_SUFFIX")
        return [folder / "python" / "holdfast" / f"_core{suffix}"], None
    return sorted((folder / "python" / "wheel").glob("_core*.so")), (folder / "libholdfast.so").resolve()


def libraries_of(file):
    """{name as asked for: path} of everything that a file loads, but the system's own."""
    found = {}
    for name, path in re.findall(r"^\s+(\S+) => (/\S+)", read("ldd", str(file)), re.M):
        # Alternatives of BLAS and LAPACK are large: those of the reference do for the sparse solvers.
        kind = re.match(r"lib(blas|lapack)\.so\.3$", name)
        reference = pathlib.Path(path).parent / kind[1] / name if kind else None
        found[name] = reference if reference and reference.exists() else pathlib.Path(path)
    return {name: path for name, path in found.items() if not SYSTEM.match(name)}


def bundle(package, modules, library):
    """Copies the libraries beside the package, under names that nobody else has in the process, and
    lets all find each other there."""
    folder = package.parent / "holdfast.libs"
    folder.mkdir()
    todo, paths = {library.name: library}, {}
    while todo:
        name, path = todo.popitem()
        if name in paths:
            continue
        paths[name] = path
        needed = set(read("patchelf", "--print-needed", str(path)).split())
        todo.update({one: at for one, at in libraries_of(path).items() if one in needed})
    names = {}
    for name, path in paths.items():
        stem, _, rest = name.partition(".so")
        digest = hashlib.sha256(path.read_bytes()).hexdigest()[:8]
        names[name] = f"{stem}-{digest}.so{rest}"
        shutil.copy(path, folder / names[name])
    soname = read("patchelf", "--print-soname", str(library)).strip()
    names[soname] = names[library.name]
    for file in [*folder.iterdir(), *(package / module.name for module in modules)]:
        file.chmod(0o755)
        run("strip", "--strip-unneeded", file)
        # One change a call: patchelf 0.14 mixes up the arguments of several.
        for name in read("patchelf", "--print-needed", str(file)).split():
            if name in names:
                run("patchelf", "--replace-needed", name, names[name], file)
        own = file.parent == folder
        if own:
            run("patchelf", "--set-soname", file.name, file)
        run("patchelf", "--set-rpath", "$ORIGIN" if own else "$ORIGIN/../holdfast.libs", file)
    return paths


def licenses(paths, folder):
    """What the distribution says of the licenses of the bundled libraries."""
    (folder / "NOTE").write_text(LICENSE_NOTE)
    shutil.copy(ROOT / "LICENSE", folder / "LICENSE")
    for name, path in paths.items():
        found = subprocess.run(["dpkg", "-S", str(path.resolve())], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        package = found.stdout.split(":")[0]
        notice = pathlib.Path("/usr/share/doc") / package / "copyright"
        if package and notice.exists():
            shutil.copy(notice, folder / f"{package}.copyright")


def pack(tree, out, tag):
    """Zips a tree as a wheel, with its RECORD; the same files give the same bytes."""
    info = tree / f"holdfast-{version()}.dist-info"
    (info / "WHEEL").write_text(f"Wheel-Version: 1.0\nGenerator: holdfast\nRoot-Is-Purelib: false\n"
                                + "".join(f"Tag: {python}-{abi}-{tag[2]}\n" for python, abi in zip(tag[0].split("."), tag[1].split("."))))
    name = f"holdfast-{version()}-{'-'.join(tag)}.whl"
    record = []
    files = sorted(file for file in tree.rglob("*") if file.is_file())
    with zipfile.ZipFile(out / name, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in files:
            content, path = file.read_bytes(), file.relative_to(tree).as_posix()
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            record.append(f"{path},sha256={digest},{len(content)}")
            entry = zipfile.ZipInfo(path, (1980, 1, 1, 0, 0, 0))
            entry.external_attr = (0o755 if file.suffix == ".so" or ".so." in file.name else 0o644) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)
        record.append(f"{info.name}/RECORD,,")
        archive.writestr(zipfile.ZipInfo(f"{info.name}/RECORD", (1980, 1, 1, 0, 0, 0)), "\n".join(record) + "\n")
    return name


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    pythons = os.environ.get("HOLDFAST_WHEEL_PYTHONS", "")
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(os.environ.get("HOLDFAST_BUILD_DIR") or pathlib.Path(scratch) / "build").resolve()
        modules, library = built(folder, pythons)
        tree = pathlib.Path(scratch) / "wheel"
        package, info = tree / "holdfast", tree / f"holdfast-{version()}.dist-info"
        shutil.copytree(ROOT / "python" / "holdfast", package, ignore=shutil.ignore_patterns("__pycache__"))
        (info / "licenses").mkdir(parents=True)
        (info / "METADATA").write_text(metadata(), encoding="utf-8")
        for module in modules:
            shutil.copy(module, package / module.name)
        if pythons:
            licenses(bundle(package, modules, library), info / "licenses")
            versions = [f"cp3{number}" for number in re.findall(r"python3\.(\d+)", pythons)]
            glibc = os.confstr("CS_GNU_LIBC_VERSION").split()[1].replace(".", "_")
            tag = (".".join(versions), ".".join(versions), f"manylinux_{glibc}_{os.uname().machine}")
        else:
            licenses({}, info / "licenses")
            run("strip", "--strip-unneeded", package / modules[0].name)
            this = f"cp{sys.version_info[0]}{sys.version_info[1]}"
            tag = (this, this, sysconfig.get_platform().replace("-", "_").replace(".", "_"))
        # The stub as it is if none of the modules is for this Python.
        for module in package.glob("_core*" + sysconfig.get_config_var("EXT_SUFFIX")):
            run(sys.executable, ROOT / "python/document_stubs.py", module, ROOT / "python/holdfast/_core.pyi", package / "_core.pyi")
        return pack(tree, pathlib.Path(wheel_directory), tag)


def build_sdist(sdist_directory, config_settings=None):
    name = f"holdfast-{version()}"
    files = subprocess.run(["git", "-C", str(ROOT), "ls-files", "-z"], check=True, stdout=subprocess.PIPE).stdout
    with tempfile.TemporaryDirectory() as scratch, tarfile.open(pathlib.Path(sdist_directory) / f"{name}.tar.gz", "w:gz") as archive:
        for file in filter(None, files.decode().split("\0")):
            archive.add(ROOT / file, f"{name}/{file}")
        about = pathlib.Path(scratch) / "PKG-INFO"
        about.write_text(metadata(), encoding="utf-8")
        archive.add(about, f"{name}/PKG-INFO")
    return f"{name}.tar.gz"
