"""Adds programs, manual pages and completions to a wheel: pip puts them into `bin` and `share` of the environment.

    python add_programs.py WHEEL FOLDER --out FOLDER

FOLDER has the programs in `programs` and everything for `share` in `share`.
"""

from __future__ import annotations

import argparse
import base64
import csv
import hashlib
import io
import stat
import zipfile
from pathlib import Path


def digest(data: bytes) -> str:
    """As RECORD has it."""
    return "sha256=" + base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()


def added(folder: Path, data: str) -> dict[str, bytes]:
    """Files by their names in the wheel."""
    programs = sorted((folder / "programs").iterdir())
    shared = sorted(path for path in (folder / "share").rglob("*") if path.is_file())
    found = {f"{data}/scripts/{path.name}": path.read_bytes() for path in programs}
    return found | {f"{data}/data/{path.relative_to(folder)}": path.read_bytes() for path in shared}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("wheel", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    with (
        zipfile.ZipFile(options.wheel) as given,
        zipfile.ZipFile(options.out / options.wheel.name, "w", zipfile.ZIP_DEFLATED) as made,
    ):
        record = next(name for name in given.namelist() if name.endswith(".dist-info/RECORD"))
        files = added(options.folder, record.split(".dist-info/")[0] + ".data")
        for entry in given.infolist():
            if entry.filename != record:
                made.writestr(entry, given.read(entry), zipfile.ZIP_DEFLATED)
        rows = [row for row in csv.reader(io.StringIO(given.read(record).decode())) if row and row[0] != record]
        for name, data in files.items():
            entry = zipfile.ZipInfo(name)
            # A regular file: pip keeps the permission to execute of these alone.
            entry.external_attr = (stat.S_IFREG | (0o755 if "/scripts/" in name else 0o644)) << 16
            made.writestr(entry, data, zipfile.ZIP_DEFLATED)
            rows.append([name, digest(data), str(len(data))])
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows([*rows, [record, "", ""]])
        made.writestr(record, text.getvalue())


if __name__ == "__main__":
    main()
