"""Report in a browser: it loads without errors or requests, the view rotates, the slider moves, the table sorts."""

import shutil
from pathlib import Path

import pytest

from tests.support.browser import CHROMIUM, HOW_TO_INSTALL, Browser

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=HOW_TO_INSTALL)
VIEW = 'document.querySelector("#view-3d .scene").viewer'
PIXELS = f"""(() => {{ const {{ gl }} = {VIEW}; const [w, h] = [gl.canvas.width, gl.canvas.height];
const all = new Uint8Array(4 * w * h); gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, all);
let sum = 0, drawn = 0; for (let k = 0; k < all.length; k += 4) {{
sum = (31 * sum + all[k] + 7 * all[k + 1]) % 1000003; drawn += all[k] < 250 || all[k + 2] < 250; }}
return [sum, drawn / (w * h)]; }})()"""
DRAWN = f"new Promise((done) => {{ {VIEW}.wake(2); requestAnimationFrame(() => requestAnimationFrame(done)); }})"
COLUMN = '[...document.querySelectorAll("table.joints tbody tr")].map((row) => row.cells[3].textContent)'


@pytest.fixture(scope="module")
def page(first_run, tmp_path_factory):
    """Yield a browser with a copy of the report of the shortened case in an otherwise empty folder."""
    folder = tmp_path_factory.mktemp("report")
    report = Path(shutil.copy(first_run[0] / "report.html", folder))
    with Browser() as browser:
        browser.open(report)
        yield browser


def pixels(page: Browser) -> list:
    """Return sampled pixels of the 3D view of a page, after it is drawn."""
    page.value(DRAWN)
    return page.value(PIXELS)


def test_it_loads_without_errors_or_requests(page):
    assert page.errors == []
    (request,) = [url for url in page.requests if not url.startswith("data:")]
    assert request.endswith("report.html")
    assert page.value('document.querySelectorAll(".uplot canvas").length') >= 10
    assert page.value("performance.getEntriesByType('resource').length") == 0


def test_headings_are_listed_and_lead_somewhere(page):
    lost = '[...document.querySelectorAll("nav a")].filter((a) => !document.querySelector(a.getAttribute("href")))'
    assert page.value(f"{lost}.length") == 0 and page.value('document.querySelectorAll("nav a").length') >= 10


def test_the_view_turns(page):
    page.value(f'{VIEW}.place.scrollIntoView({{ block: "center" }})')
    before, drawn = pixels(page)
    assert drawn > 0.05
    box = page.value(
        f"(({{ x, y, width, height }}) => [x, y, width, height])({VIEW}.gl.canvas.getBoundingClientRect())"
    )
    middle = box[0] + 0.5 * box[2], box[1] + 0.5 * box[3]
    page.drag(middle, (middle[0] + 150, middle[1] + 40))
    after, still_drawn = pixels(page)
    assert after != before and still_drawn > 0.05


def test_the_slider_moves_the_time(page):
    (before, _), time_label = pixels(page), page.value(f"{VIEW}.time.textContent")
    page.value(f'{VIEW}.slider.value = 0; {VIEW}.slider.dispatchEvent(new Event("input"))')
    assert pixels(page)[0] != before
    assert page.value(f"{VIEW}.time.textContent") == "0 ms" != time_label


def test_the_table_sorts_and_shows_a_joint(page):
    peel = [float(text) for text in page.value(COLUMN)]
    assert peel == sorted(peel, reverse=True)
    head = 'document.querySelectorAll("table.joints th button")[3].click()'
    page.value(f"{head}; {head}")
    assert [float(text) for text in page.value(COLUMN)] == sorted(peel)
    page.value('document.querySelector("table.joints tbody tr").click()')
    name = page.value('document.querySelector("tr.picked").dataset.joint')
    assert page.value(f"{VIEW}.scene.parts[{VIEW}.chosen]") == f"solder@{name}"
    assert name in page.value(f"{VIEW}.tip.textContent")
    page.value('document.querySelector("tr.picked").click()')
    assert page.value(f"{VIEW}.chosen") == -1


@pytest.mark.parametrize("width", [700, 1300])
def test_it_fits_the_window(page, width):
    page.resize(width, 900)
    page.value("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    assert page.value("document.documentElement.scrollWidth") <= width


@pytest.mark.long
def test_it_prints(page, tmp_path):
    page.pdf(tmp_path / "page.pdf")
    assert (tmp_path / "page.pdf").read_bytes().startswith(b"%PDF") and page.errors == []
