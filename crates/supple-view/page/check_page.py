"""Opens the live page of a simulated and of an emulated arm in headless Chromium and checks what a person would see.

    python check_page.py PATH/TO/supple FOLDER_FOR_SCREENSHOTS

Needs `pip install playwright` and Chromium (`CHROMIUM` names another program).
"""

import contextlib
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright

FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
# Time after which an arm ends if this check does not end it [s of the arm's time].
LONGEST_S = 36_000
READ = "id => document.getElementById(id).textContent"
INK = """id => [...document.getElementById(id).querySelectorAll('canvas')].map(c => c.toDataURL()).join()"""


def until(page: Page, what: str, condition, seconds: float = 60.0) -> None:
    """Waits until the condition holds."""
    for _ in range(int(seconds * 5)):
        if condition():
            print(f"ok: {what}", flush=True)
            return
        page.wait_for_timeout(200)
    raise AssertionError(what)


def check(page: Page, url: str, folder: Path, scheme: str, plant: str) -> None:
    """Checks the page of a running arm."""
    complaints: list[str] = []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: foreign(request.url, url, complaints))
    sent: list[dict] = []
    page.on("websocket", lambda socket: socket.on("framesent", lambda data: note_command(data, sent)))
    page.goto(url)
    read = lambda name: page.evaluate(READ, name)
    until(page, "the arm tracks", lambda: read("mode") == "track")
    page.wait_for_timeout(2000)
    scene = page.locator("#scene canvas")
    before, ink = scene.screenshot(), page.evaluate(INK, "plots")
    page.wait_for_timeout(2000)
    assert scene.screenshot() != before, "the arm moves"
    assert page.evaluate(INK, "plots") != ink, "the plots update"
    print("ok: the arm moves, the plots update", flush=True)
    page.wait_for_timeout(4000)
    page.screenshot(path=str(folder / f"page-{scheme}.png"), full_page=True)

    slider = page.locator("#stiffness")
    old = float(read("stiffness-reported").split()[0])
    sent.clear()
    slider.focus()
    for _ in range(12):
        page.keyboard.press("ArrowRight")
    wanted = float(read("stiffness-wanted").split()[0])
    assert wanted > old + 0.5, f"the slider moved from {old} to {wanted} N/m"
    reported = lambda: float(read("stiffness-reported").split()[0])
    # The controller's own value, after its ramp; the page shows one decimal.
    until(page, f"stiffness {old} became {wanted} N/m", lambda: abs(reported() - wanted) <= 0.051)
    gains = [command["stiffness_n_per_m"] for command in sent if command["request"] == "gains"]
    assert gains[-1] == [wanted] * 3, f"the last request has the last value: {gains}"

    page.get_by_role("button", name="Gravity hold").click()
    until(page, "gravity hold", lambda: read("mode") == "gravity hold")
    page.get_by_role("button", name="Hold tip").click()
    until(page, "hold tip", lambda: read("mode") == "track")
    assert page.locator("#answer.refused").count() == 0, read("answer")
    # Only the emulated arm has a pendant; its emergency stop takes the power of drives and encoders.
    if plant == "emu":
        page.get_by_role("button", name="Emergency stop", exact=True).click()
        until(page, "the emergency stop is a fault", lambda: read("mode") == "fault")
        until(page, "the pendant has answered", lambda: read("answer") == "Emergency stop: pressed")
        assert "no encoder reply" in read("fault-text"), read("fault-text")
        assert read("fault-remedy"), "the fault has a remedy"
    else:
        page.get_by_role("button", name="Idle", exact=True).click()
        until(page, "idle takes the drives' power", lambda: read("drives") == "idle")
    page.wait_for_timeout(500)
    page.screenshot(path=str(folder / f"stopped-{scheme}.png"), full_page=True)
    assert not complaints, complaints


def foreign(url: str, own: str, complaints: list[str]) -> None:
    """Notes a request to another server."""
    if not url.startswith((own, "data:", "blob:")):
        complaints.append(f"request to {url}")


def note_command(data: str | bytes, sent: list[dict]) -> None:
    """Notes a command that the page sends: JSON after the header of a call of the Foxglove protocol."""
    if isinstance(data, bytes) and data[:1] == b"\x02":
        sent.append(json.loads(data[data.index(b"{") :]))


def check_running(browser: Browser, program: Path, folder: Path, scheme: str, plant: str) -> None:
    """Starts an arm and checks its page. The arm's time is virtual: Chromium can use all processors for its drawing.

    The simulated arm brings its page (`--view`). In virtual time the emulated arm ends with the fault: the viewer is on its own.
    """
    with tempfile.TemporaryDirectory() as work, contextlib.ExitStack() as running:
        system = ["--prefix", f"page-{scheme}"]
        options = [*system, "--block-m", "-0.3", "--virtual-time", "--for", str(LONGEST_S), "--no-log"]
        up = start(running, [program, "up", "--plant", plant, *options, *(["--view"] if plant == "sim" else [])], Path(work) / "up")
        viewer = up
        if plant == "emu":
            until_in(up, "track,")
            viewer = start(running, [program, "view", *system, "--block-m", "-0.3"], Path(work) / "view")
        url = until_in(viewer, r"http://127\.0\.0\.1\S+")
        context = browser.new_context(color_scheme=scheme, viewport={"width": 1280, "height": 900})
        try:
            check(context.new_page(), url, folder, scheme, plant)
        except Exception:
            print(up.output.read_text(), file=sys.stderr)
            raise
        finally:
            running.close()
            context.close()


class Program(subprocess.Popen):
    """A program with its output in a file."""

    output: Path


def start(running: contextlib.ExitStack, command: list, output: Path) -> Program:
    """Starts a program, which ends with `running`."""
    with output.open("w") as file:
        program = Program(command, stdout=file, stderr=file)
    program.output = output
    running.callback(end, program)
    return program


def end(program: Program) -> None:
    """Ends a program."""
    program.terminate()
    try:
        program.wait(timeout=60)
    except subprocess.TimeoutExpired:
        program.kill()
        program.wait()


def until_in(program: Program, pattern: str) -> str:
    """Waits until a program prints something; returns it."""
    for _ in range(600):
        if found := re.search(pattern, program.output.read_text()):
            return found[0]
        if program.poll() is not None:
            break
        time.sleep(0.1)
    raise AssertionError(f"the program has not printed {pattern}: {program.output.read_text()}")


def main() -> None:
    program, folder = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    chromium = os.environ.get("CHROMIUM", "/usr/bin/chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        for scheme, plant in (("light", "sim"), ("dark", "emu")):
            check_running(browser, program, folder, scheme, plant)
        browser.close()
    print(f"screenshots in {folder}")


if __name__ == "__main__":
    main()
