"""The package is typed: strictly, and as it is at run time."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import wheatstone

PACKAGE = Path(wheatstone.__file__).parent
SETTINGS = Path(__file__).parent.parent / "pyproject.toml"


def run(module: str, *arguments: str) -> None:
    pytest.importorskip(module.partition(".")[0])
    path = os.pathsep.join([str(PACKAGE.parent), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-m", module, *arguments]
    environment = {**os.environ, "MYPYPATH": str(PACKAGE.parent), "PYTHONPATH": path}
    told = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=PACKAGE.parent)
    assert told.returncode == 0, told.stdout + told.stderr


def test_mypy_is_content():
    run("mypy", "--strict", "--config-file", str(SETTINGS), "--no-incremental", str(PACKAGE))


def test_stubs_are_what_the_module_is():
    run("mypy.stubtest", "wheatstone._wheatstone", "--ignore-missing-stub", "--mypy-config-file", str(SETTINGS))


def test_every_public_name_has_a_docstring():
    public = [getattr(wheatstone, name) for name in wheatstone.__all__]
    public += [getattr(wheatstone.errors, name) for name in wheatstone.errors.__all__]
    for thing in public:
        if callable(thing):
            assert thing.__doc__, thing
        if isinstance(thing, type) and thing.__module__.startswith("wheatstone"):
            for name, member in vars(thing).items():
                if not name.startswith("_") and (callable(member) or isinstance(member, property)):
                    assert member.__doc__, f"{thing.__name__}.{name}"
