"""Opens the live page of a simulated and of an emulated arm in headless Chromium and checks what a person would see.

    python check_page.py PATH/TO/supple FOLDER_FOR_SCREENSHOTS

Needs `pip install playwright` and Chromium (`CHROMIUM` names another program).
"""

import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import Browser, Page, sync_playwright

FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
READ = "id => document.getElementById(id).textContent"
INK = """id => [...document.getElementById(id).querySelectorAll('canvas')].map(c => c.toDataURL()).join()"""


class Complaint(Exception):
    """Errors of the page and requests to other servers: no stall of the machine causes them."""


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
    old = read("stiffness-reported")
    slider.focus()
    for _ in range(12):
        page.keyboard.press("ArrowRight")
    wanted = float(read("stiffness-wanted").split()[0])
    reported = lambda: float(read("stiffness-reported").split()[0])
    # The controller's own value, after its ramp; the page shows one decimal.
    until(page, f"stiffness {old} became {wanted} N/m", lambda: abs(reported() - wanted) <= 0.051)

    page.get_by_role("button", name="Gravity hold").click()
    until(page, "gravity hold", lambda: read("mode") == "gravity hold")
    page.get_by_role("button", name="Hold tip").click()
    until(page, "hold tip", lambda: read("mode") == "track")
    # Only the emulated arm has a pendant.
    name = {"emu": "Emergency stop", "sim": "Idle"}[plant]
    page.get_by_role("button", name=name, exact=True).first.click()
    until(page, f"{name} takes the drives' power", lambda: read("drives") == "idle")
    page.wait_for_timeout(500)
    page.screenshot(path=str(folder / f"stopped-{scheme}.png"), full_page=True)
    if complaints:
        raise Complaint(complaints)


def foreign(url: str, own: str, complaints: list[str]) -> None:
    """Notes a request to another server."""
    if not url.startswith((own, "data:", "blob:")):
        complaints.append(f"request to {url}")


def has_stalled(program: Path, prefix: str) -> bool:
    """Whether answers were missed, and the drives are idle or a fault is latched for it, as after a stall of the machine."""
    done = subprocess.run([program, "status", "--prefix", prefix, "--json"], capture_output=True, text=True, check=False)
    status = json.loads(done.stdout) if done.stdout else {}
    lost = status.get("drives") == "idle" and status.get("mode") == "gravity_hold"
    late = any(words in (status.get("fault") or "") for words in ("no new arm state", "no encoder reply"))
    return (status.get("missed") or 0) > 0 and (lost or late)


def check_running(browser: Browser, program: Path, folder: Path, scheme: str, plant: str) -> None:
    """Starts an arm and checks its page; begins again, at most four times, if the machine stalls: drawing the page needs all processors."""
    prefix = f"page-{scheme}"
    for attempts_left in reversed(range(5)):
        with tempfile.TemporaryDirectory() as work:
            command = [program, "up", "--plant", plant, "--view", "--no-realtime", "--prefix", prefix]
            command += ["--block-m", "-0.3", "--log", Path(work) / "page.mcap"]
            context = browser.new_context(color_scheme=scheme, viewport={"width": 1280, "height": 900})
            up = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
            try:
                lines = iter(up.stderr.readline, "")
                url = next(found[0] for line in lines if (found := re.search(r"http://127\.0\.0\.1\S+", line)))
                return check(context.new_page(), url, folder, scheme, plant)
            except Complaint:
                raise
            except Exception as failure:
                if attempts_left == 0 or not has_stalled(program, prefix):
                    raise
                print(f"the machine stalled, the check begins again after this failure: {failure}", flush=True)
            finally:
                up.terminate()
                try:
                    up.communicate(timeout=60)
                except subprocess.TimeoutExpired:
                    up.kill()
                    up.communicate()
                context.close()
    raise AssertionError("no attempt")


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
