"""Builds the site of the documentation: gathers pages, generates the reference, and runs mkdocs.

The pages are those of the repository at the same paths, so that a link works here and there. `run_commands.py` has made the
figures and `notebooks.py` the pages of the notebooks. The reference of the command line is what `--help` prints; that of Python
is the docstrings of the installed package; that of Rust is what `cargo doc` has left in --rustdoc.

    python docs/site/build.py --programs target/debug --figures target/site/figures --notebooks target/site/notebooks
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from command_line import CommandLine
from pages import FIGURE, ROOT, pages

SITE = ROOT / "target/site"
PAGES = SITE / "pages"
HTML = SITE / "html"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--programs", type=Path, required=True, help="folder of the programs")
    parser.add_argument("--figures", type=Path, required=True, help="folder that run_commands.py has filled")
    parser.add_argument("--notebooks", type=Path, required=True, help="folder that notebooks.py has filled")
    parser.add_argument("--rustdoc", type=Path, help="folder of `cargo doc`, to be part of the site")
    arguments = parser.parse_args()
    shutil.rmtree(PAGES, ignore_errors=True)
    gather(arguments.figures)
    shutil.copytree(arguments.notebooks, PAGES / "docs/notebooks")
    shutil.copyfile(Path(__file__).with_name("site.css"), PAGES / "site.css")
    write("docs/command_line.md", CommandLine(arguments.programs).reference())
    write("docs/python.md", python_reference())
    write("docs/rust.md", rust_reference(arguments.rustdoc))
    # Without --quiet: with it, warnings do not count.
    mkdocs = [sys.executable, "-m", "mkdocs", "build", "--strict"]
    command = [*mkdocs, "--config-file", str(Path(__file__).with_name("mkdocs.yml"))]
    # The theme announces its successor at every build.
    status = subprocess.run(command, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"}, check=False).returncode
    if status == 0 and arguments.rustdoc:
        shutil.copytree(arguments.rustdoc, HTML / "rustdoc", dirs_exist_ok=True)
    return status or outside_requests()


def write(path: str, text: str) -> None:
    target = PAGES / path
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(text, encoding="utf-8")


def gather(figures: Path) -> None:
    """Copies every page, and what it links to or shows."""
    for name in pages():
        page = ROOT / name
        text = page.read_text(encoding="utf-8")
        for target in re.findall(r"\]\(([^)#]+)", text):
            linked = (page.parent / target).resolve()
            if "://" in target or linked.suffix in (".md", ".ipynb") or not linked.is_file():
                continue
            copy = PAGES / linked.relative_to(ROOT)
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(linked, copy)
        if any((figures / page.stem).glob("*")):
            shutil.copytree(figures / page.stem, (PAGES / name).parent / "figures" / page.stem, dirs_exist_ok=True)
        shown = FIGURE.sub(lambda match, stem=page.stem: figure(match, stem), text)
        write(name, re.sub(r"(\]\([^):]+)\.ipynb\)", r"\1.md)", shown))


def figure(match: re.Match[str], stem: str) -> str:
    """A figure with its caption below it; a missing file is an error of mkdocs."""
    path = f"figures/{stem}/{Path(match['file']).name}"
    caption = match["caption"]
    return f"![{caption.replace('`', '')}]({path})\n\n*{caption}*{{ .caption }}\n"


def python_reference() -> str:
    script = Path(__file__).with_name("python_reference.py")
    return subprocess.run([sys.executable, script], check=True, capture_output=True, text=True).stdout


def rust_reference(rustdoc: Path | None) -> str:
    """The crates with the first sentence of their documentation, and a link to it if it is part of the site."""
    rows = []
    for path in sorted((ROOT / "crates").glob("*/src/lib.rs")):
        crate = path.parts[-3]
        first = re.match(r"//! (.+?)(?:\.(?:\s|$)|\n(?!//!)|\n//!\n)", path.read_text(encoding="utf-8"), re.DOTALL)
        about = re.sub(r"\s*\n//! ?", " ", first[1]).replace("|", r"\|") if first else ""
        about = re.sub(r"\[(`[^`]+`)\]", r"\1", about)
        index = f"rustdoc/{crate.replace('-', '_')}/index.html"
        has_page = rustdoc is not None and (rustdoc / index.removeprefix("rustdoc/")).is_file()
        rows.append(f'| {f"<a href=../{index}>{crate}</a>" if has_page else f"`{crate}`"} | {about} |')
    return (
        "# Rust\n\n`cargo doc --workspace --exclude supple-python --no-deps --open` shows the documentation of all crates. "
        "[Architecture](../ARCHITECTURE.md) shows how they depend on each other; `supple_core::controller::step` is where to "
        "begin reading.\n\n| crate | what it is |\n|---|---|\n" + "\n".join(rows) + "\n"
    )


def outside_requests() -> int:
    """No page may load anything from elsewhere when it is looked at; links that somebody follows may."""
    loads = re.compile(r'<(?:script|img|iframe|source)\b[^>]*\bsrc="?https?:|<link\b(?=[^>]*\brel="?(?:stylesheet|preconnect|icon))[^>]*\bhref="?https?:')
    wrong = [
        str(page.relative_to(HTML))
        for page in HTML.rglob("*.html")
        if "rustdoc" not in page.parts and loads.search(page.read_text(encoding="utf-8"))
    ]
    for page in wrong:
        print(f"{page} loads something from elsewhere")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
