"""Install the system packages that are missing, or print the exact command that does.

Open3D loads libusb-1.0, libGL, libEGL and libgomp; Debian ships Python without venv.
"""

from __future__ import annotations

import ctypes.util
import importlib.util
import os
import shutil
import subprocess
import sys

PACKAGES = {
    "usb-1.0": "libusb-1.0-0",
    "GL": "libgl1",
    "EGL": "libegl1",
    "gomp": "libgomp1",
}


def main() -> int:
    """Install what is missing; a failure is told, and the build goes on as far as it can."""
    missing = [package for name, package in PACKAGES.items() if not _found(name)]
    if importlib.util.find_spec("ensurepip") is None:
        missing.append(f"python{sys.version_info.major}.{sys.version_info.minor}-venv")
    if not missing:
        return 0
    install = ["apt-get", "install", "-y", "--no-install-recommends", *missing]
    if shutil.which("apt-get") and os.geteuid() == 0:
        environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
        quiet = {"env": environment, "stdout": subprocess.DEVNULL, "stderr": subprocess.STDOUT}
        subprocess.run(["apt-get", "update"], check=False, **quiet)  # noqa: S607
        if subprocess.run(install, check=False, **quiet).returncode == 0:  # noqa: S603
            return 0
    command = f"sudo apt-get update && sudo {' '.join(install)}"
    sys.stderr.write(f"System packages are missing. Install them:\n  {command}\n")
    return 0


def _found(name: str) -> bool:
    for candidate in (ctypes.util.find_library(name), f"lib{name}.so.0", f"lib{name}.so.1"):
        try:
            if candidate:
                ctypes.CDLL(candidate)
                return True
        except OSError:
            continue
    return False


if __name__ == "__main__":
    sys.exit(main())
