"""Pages that evslip makes, for readers of every kind: benchmarks/accessibility.py --axe AXE.JS [--out FOLDER] PAGE ...

PAGE is an address or an HTML file, or one of

  site=FOLDER      three pages of the documentation's site (`make docs`)
  view=DATASET     the explorer: list and first sample
  label=RECORDING  the page to label on
  play=MODEL       the page of the closed loop
  live=FILE        the page of `evslip live`, on a file of events

Each is opened in Chromium at 360, 768 and 1440 pixels, light and dark, and at each of these: axe-core's rules are run
(AXE.JS: axe.min.js of the npm package axe-core; WCAG 2.1, A and AA), the page must not be wider than the window, nor
print errors. At one width all that can be operated must be reached by Tab, each with an outline that shows where it is.
Findings are printed, serious and critical ones with exit code 1; --out keeps a picture of each.
"""

import argparse
import itertools
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from playwright import sync_api

WIDTHS, HEIGHT = (360, 768, 1440), 900
SCHEMES = ("light", "dark")
TAGS = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "best-practice"]
SETTLE_MS = 1500
MOST_TABS = 120
SITE = ("index.html", "explanation/benchmarks.html", "reference/api/events.html", "reference/parameters.html")
FOCUSED = """() => {
    const here = document.activeElement;
    if (!here || here === document.body) return null;
    const style = getComputedStyle(here), box = here.getBoundingClientRect();
    const marked = style.outlineStyle !== "none" && style.outlineWidth !== "0px" || style.boxShadow !== "none";
    here.dataset.reached = "1";
    return {name: here.outerHTML.slice(0, 90), marked: marked || here.tagName === "IFRAME", shown: box.width > 0};
}"""
MISSED = """() => [...document.querySelectorAll("a[href], button, input, select, textarea, summary")]
    .filter(one => !one.disabled && one.tabIndex >= 0
        && one.checkVisibility({visibilityProperty: true, opacityProperty: true})
        && one.getBoundingClientRect().width > 0 && !one.dataset.reached
        && !(one.type === "radio" && document.querySelector(`[name="${one.name}"][data-reached]`)))
    .map(one => one.outerHTML.slice(0, 90))"""


@contextmanager
def serving(verb: str, subject: str, *more: str) -> Iterator[str]:
    """Address of a page that evslip serves, as long as it is open. more: further words of the command."""
    words = {"play": ["play", "--model", subject], "live": ["live", subject, "--page", "0"]}.get(verb, [verb, subject])
    options = [] if verb == "live" else ["--no-browser", "--port", "0"]
    command = [sys.executable, "-m", "evslip", *words, *more, *options]
    unbuffered = {**os.environ, "PYTHONUNBUFFERED": "1"}
    process = subprocess.Popen(command, env=unbuffered, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        assert process.stdout is not None
        said = list[str]()
        for line in process.stdout:
            said.append(line)
            if "http://" in line:
                yield "http://" + line.partition("http://")[2].split()[0]
                return
        sys.exit(f"{' '.join(command)} ended: {''.join(said)}")
    finally:
        process.terminate()
        process.wait()


def addresses(page: str, stack: ExitStack) -> list[str]:
    """Addresses of a page that was asked for."""
    kind, _, subject = page.partition("=")
    if kind == "site":
        return [(Path(subject) / name).resolve().as_uri() for name in SITE if (Path(subject) / name).is_file()]
    if kind in ("view", "label", "play", "live"):
        address = stack.enter_context(serving(kind, subject))
        return [address, f"{address}sample/0"] if kind == "view" else [address]
    return [page if "://" in page else Path(page).resolve().as_uri()]


def examined(page: sync_api.Page, axe: str) -> Iterator[tuple[str, str]]:
    """Impact and text of each finding."""
    page.evaluate(axe)
    found: dict[str, Any] = page.evaluate("tags => axe.run({runOnly: tags, preload: false})", TAGS)
    for one in found["violations"]:
        first = one["nodes"][0]
        told = f"{one['id']}: {one['help']} ({len(one['nodes'])}): {first['html'][:140]}"
        why = [check["message"] for check in first["any"] + first["all"] + first["none"]]
        yield one["impact"] or "minor", f"{told} | {' '.join(why)[:160]}"
    wide = page.evaluate("document.documentElement.scrollWidth - window.innerWidth")
    if wide > 0:
        yield "serious", f"wider than the window by {wide} px"


def by_keyboard(page: sync_api.Page) -> Iterator[tuple[str, str]]:
    """What Tab does not reach, and what does not show that it was reached."""
    first = None
    for _ in range(MOST_TABS):
        page.keyboard.press("Tab")
        here = page.evaluate(FOCUSED)
        if here is None or here["name"] == first:
            break
        first = first or here["name"]
        if not here["marked"] and here["shown"]:
            yield "serious", f"the focus does not show: {here['name']}"
    else:
        return  # Long pages are not walked to their end.
    missed = page.evaluate(MISSED)
    if missed:
        yield "serious", f"Tab does not reach {len(missed)}: {missed[0]}"


def findings(
    browser: sync_api.Browser, address: str, axe: str, pictures: Path | None
) -> dict[tuple[str, str], list[str]]:
    """Impact and text of what is wrong with a page, and at which widths and in which schemes."""
    found: dict[tuple[str, str], list[str]] = {}
    for width, scheme in itertools.product(WIDTHS, SCHEMES):
        page = browser.new_page(viewport={"width": width, "height": HEIGHT}, color_scheme=scheme)
        errors: list[str] = []
        page.on("console", lambda said, to=errors: to.append(said.text) if said.type == "error" else None)
        page.on("pageerror", lambda error, to=errors: to.append(str(error)))
        page.goto(address)
        page.wait_for_timeout(SETTLE_MS)
        if pictures:
            page.screenshot(path=pictures.with_name(f"{pictures.name}-{width}-{scheme}.png"))
        wrong = [*examined(page, axe)]
        if (width, scheme) == (WIDTHS[-1], SCHEMES[0]):
            wrong += by_keyboard(page)
        for finding in [*wrong, *(("serious", f"error in the console: {text}") for text in errors)]:
            found.setdefault(finding, []).append(f"{width} {scheme}")
        page.close()
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", metavar="PAGE", nargs="+")
    parser.add_argument("--axe", type=Path, required=True)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    axe = asked.axe.read_text(encoding="utf-8")
    if asked.out:
        asked.out.mkdir(parents=True, exist_ok=True)
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    worst = number = 0
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-gpu"])
        for name in asked.pages:
            with ExitStack() as stack:
                for address in addresses(name, stack):
                    number += 1
                    found = findings(browser, address, axe, asked.out and asked.out / f"{number:02}")
                    print(f"{number:02} {address}: {len(found)} findings", flush=True)
                    for (impact, text), where in sorted(found.items()):
                        worst += impact in ("serious", "critical")
                        at = "everywhere" if len(where) == len(WIDTHS) * len(SCHEMES) else ", ".join(where)
                        print(f"   {impact}: {text}  [{at}]", flush=True)
        browser.close()
    print(f"{worst} serious findings")
    return int(worst > 0)


if __name__ == "__main__":
    sys.exit(main())
