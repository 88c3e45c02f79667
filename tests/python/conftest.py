"""The log under test: the file named by SUPPLE_TEST_LOG, or one that is written for the test."""

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def example(name: str, *arguments: Path) -> None:
    """Runs an example of the log crate."""
    command = ["cargo", "run", "--quiet", "--package", "supple-log", "--example", name, "--"]
    subprocess.run([*command, *map(str, arguments)], check=True, cwd=ROOT)


@pytest.fixture(scope="session")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A complete log."""
    given = os.environ.get("SUPPLE_TEST_LOG")
    if given:
        return Path(given).resolve()
    path = tmp_path_factory.mktemp("log") / "sample.mcap"
    example("sample_log", path)
    return path


@pytest.fixture(scope="session")
def cut_log(log: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first two thirds of the log, as after a crash."""
    path = tmp_path_factory.mktemp("cut") / "cut.mcap"
    content = log.read_bytes()
    path.write_bytes(content[: len(content) * 2 // 3])
    return path


@pytest.fixture(scope="session")
def recovered_log(cut_log: Path) -> Path:
    """The records recovered from the truncated log."""
    path = cut_log.with_name("recovered.mcap")
    example("recover_log", cut_log, path)
    return path
