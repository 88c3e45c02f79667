"""Runs the notebooks of the documentation and writes each as a page with its outputs.

A notebook in the repository has no outputs; one that has is an error. Each runs in an empty folder, with the programs on its
path; a cell that raises fails the build.

    python docs/site/notebooks.py --programs target/debug --out target/site/notebooks [NOTEBOOK...]
"""

from __future__ import annotations

import argparse
import base64
import json
import os
import re
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import nbformat
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from nbformat import NotebookNode

from pages import ROOT

FOLDER = ROOT / "docs/notebooks"
CELL_TIMEOUT_S = 300
# Figures for screens of two pixels per point.
SETUP = "import matplotlib_inline\nmatplotlib_inline.backend_inline.set_matplotlib_formats('retina')"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--programs", type=Path, required=True, help="folder of the programs")
    parser.add_argument("--out", type=Path, required=True, help="folder for the pages")
    parser.add_argument("notebooks", nargs="*", type=Path, help="default: all in docs/notebooks")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    chosen = [path.resolve() for path in arguments.notebooks] or sorted(FOLDER.glob("*.ipynb"))
    os.environ["PATH"] = f"{arguments.programs.resolve()}{os.pathsep}{os.environ['PATH']}"
    os.environ["SUPPLE_CHECKOUT"] = str(ROOT)
    # Pages have no progress bars.
    os.environ["TQDM_DISABLE"] = "1"
    with ThreadPoolExecutor(2) as pool:
        problems = [problem for problem in pool.map(lambda path: built(path, arguments.out), chosen) if problem]
    print("\n".join([*problems, f"{len(chosen)} notebooks run, {len(problems)} failed"]))
    return 1 if problems or not chosen else 0


def built(path: Path, out: Path) -> str | None:
    """Runs a notebook and writes its page; what is wrong with it."""
    notebook = nbformat.read(path, as_version=4)
    if any(cell.get("outputs") or cell.get("execution_count") for cell in notebook.cells):
        return f"{path.name} has outputs: clear them before a commit"
    begin = time.monotonic()
    try:
        run(notebook)
    except (CellExecutionError, TimeoutError) as error:
        return f"{path.name}: {error}"
    (out / path.with_suffix(".md").name).write_text(page(notebook, path.stem, out), encoding="utf-8")
    print(f"{path.name}: {time.monotonic() - begin:.0f} s")
    return None


def run(notebook: NotebookNode) -> None:
    """Runs every cell. The kernel listens on sockets in a folder, not on ports."""
    notebook.cells.insert(0, nbformat.v4.new_code_cell(SETUP))
    with tempfile.TemporaryDirectory(prefix="notebook-") as folder:
        manager = AsyncKernelManager(kernel_name="python3", transport="ipc")
        manager.connection_file = str(Path(folder) / "kernel.json")
        manager.ip = str(Path(folder) / "socket")
        client = NotebookClient(
            notebook, km=manager, timeout=CELL_TIMEOUT_S, resources={"metadata": {"path": folder}}
        )
        client.execute()
    del notebook.cells[0]


def page(notebook: NotebookNode, name: str, out: Path) -> str:
    """A notebook as a page: its cells and outputs, figures as files beside it."""
    parts: list[str] = []
    heading = name
    figures = 0
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            parts.append(cell.source)
            heading = (re.findall(r"^#+ (.*)$", cell.source, re.MULTILINE) or [heading])[-1]
            continue
        parts.append(f"```python\n{cell.source.strip()}\n```")
        for output in cell.outputs:
            if output.output_type == "stream":
                parts.append(text_block(output.text))
            elif "image/png" in output.data:
                figures += 1
                file = f"{name}-{figures}.png"
                (out / file).write_bytes(base64.b64decode(output.data["image/png"]))
                width = next(iter(output.metadata.get("image/png", {}).values()), "")
                size = f'{{ width="{width}" }}' if width else ""
                parts.append(f"![{heading}]({file}){size}")
            elif "text/html" in output.data:
                html = re.sub(r"<style.*?</style>", "", output.data["text/html"], flags=re.DOTALL)
                lines = [line for line in html.splitlines() if line.strip()]
                parts.append("\n".join(['<div class="output">', *lines, "</div>"]))
            elif "text/plain" in output.data:
                parts.append(text_block(output.data["text/plain"]))
    title, *rest = parts[0].split("\n", 1)
    download = f"[Download this notebook]({name}.ipynb); its outputs are those of the build of this site."
    (out / f"{name}.ipynb").write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return "\n\n".join([title, download, *rest, *parts[1:]]) + "\n"


def text_block(text: str) -> str:
    """Plain text as a block without highlighting."""
    return f'```{{ .text .output }}\n{text.rstrip()}\n```'


if __name__ == "__main__":
    sys.exit(main())
