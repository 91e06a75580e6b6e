"""On what, and beside what, the times were taken."""

from __future__ import annotations

import os
import platform
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

PACKAGES = ("numpy", "scipy", "clarabel", "osqp", "cvxpy")

#: Variables that limit the threads of linear algebra.
THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def describe_machine() -> dict[str, Any]:
    """Processor, memory, threads, versions, the date, and how busy it is now."""
    import numpy as np
    import psutil

    config: Any = np.show_config(mode="dicts")
    limits = {name: os.environ[name] for name in THREADS if name in os.environ}
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "memory": psutil.virtual_memory().total,
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "versions": {name: _version(name) for name in PACKAGES},
        "linear_algebra": config["Build Dependencies"]["blas"].get("name", "unknown"),
        "linear_algebra_threads": limits or "not limited",
        "transform_threads": "one, and all cores for large transforms",
        "date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "load_average": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
    }


def busy(machine: dict[str, Any]) -> bool:
    """Whether other work ran at the start, so that times are those of a shared machine."""
    load = machine["load_average"]
    return load is not None and load > 0.3


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or "unknown"


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "missing"
