"""The package is typed: strictly, and as it is at run time."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import wheatstone

PACKAGE = Path(wheatstone.__file__).parent
OWN = Path(__file__).parent.parent
SETTINGS = OWN / "pyproject.toml"
BUILT_ON = {"ray": "ray", "sklearn": "sklearn", "spark": "pyspark"}
"""What modules of the package, by their names, are built on."""


def run(module: str, *arguments: str) -> None:
    pytest.importorskip(module.partition(".")[0])
    path = os.pathsep.join([str(PACKAGE.parent), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-m", module, *arguments]
    environment = {**os.environ, "MYPYPATH": str(PACKAGE.parent), "PYTHONPATH": path}
    told = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=PACKAGE.parent)
    assert told.returncode == 0, told.stdout + told.stderr


def test_mypy_is_content():
    run("mypy", "--strict", "--config-file", str(SETTINGS), "--no-incremental", str(PACKAGE))


def test_pyright_is_content(tmp_path: Path):
    pytest.importorskip("pyright")
    for library in ("pandas", "pyarrow"):
        pytest.importorskip(library)
    command = [sys.executable, "-m", "pyright"]
    environment = {**os.environ, "PYRIGHT_PYTHON_IGNORE_WARNINGS": "1"}
    version = subprocess.run([*command, "--version"], capture_output=True, text=True, env=environment)
    if version.returncode != 0:
        lines = (version.stdout + version.stderr).strip().splitlines()
        pytest.skip(f"NOT TESTED: pyright, which finds no Node.js here ({lines[-1] if lines else 'no message'})")
    # A copy, since the extension module is not beside its stubs in the sources.
    shutil.copy(SETTINGS, tmp_path)
    for source, folder in ((PACKAGE, tmp_path / "wheatstone"), (OWN / "examples", tmp_path / "examples")):
        folder.mkdir()
        for path in [*source.glob("*.py"), *source.glob("*.pyi")]:
            library = BUILT_ON.get(path.stem, "numpy")
            if source != PACKAGE:
                name = path.stem.partition("_")[0]
                library = BUILT_ON.get(name, name)
            # What is not installed has no types.
            if importlib.util.find_spec(library):
                shutil.copy(path, folder)
    told = subprocess.run(
        [*command, "--pythonpath", sys.executable], capture_output=True, text=True, env=environment, cwd=tmp_path
    )
    assert told.returncode == 0, told.stdout + told.stderr


def test_stubs_are_what_the_module_is():
    run("mypy.stubtest", "wheatstone._wheatstone", "--ignore-missing-stub", "--mypy-config-file", str(SETTINGS))


def test_every_public_name_has_a_docstring():
    public = [getattr(wheatstone, name) for name in wheatstone.__all__]
    public += [getattr(wheatstone.errors, name) for name in wheatstone.errors.__all__]
    for thing in public:
        if callable(thing):
            assert thing.__doc__, thing
        if isinstance(thing, type):
            for owner in thing.__mro__:
                for name, member in vars(owner).items() if owner.__module__.startswith("wheatstone") else ():
                    if not name.startswith("_") and (callable(member) or isinstance(member, property)):
                        assert member.__doc__, f"{thing.__name__}.{name}"
