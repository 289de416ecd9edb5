"""`rosrun sara_lab touch_pictures`: every screen of the touch screen on a tablet and a telephone, in both languages.

The whole stack runs on a simulated chair in the flat; a short story is driven in Chromium, and the pictures of
src/sara_hmi/docs/images are made anew. It also says how heavy the first load is and when the page can be used.
"""

from __future__ import annotations

import argparse
import base64
import io
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import rospkg
from PIL import Image

from sara_hmi.browser.page import Page, browsing
from sara_lab.ros.touch.whole_chair import a_node, whole_chair

START = (2.0, 4.9, 0.0)  # the corridor's west end, with a wall behind the chair
SIZES = {'tablet': (1024, 768), 'phone': (390, 844)}
LANGUAGES = ('en', 'es')
TOP = 'document.getElementById("screen").scrollTop = 0'
MARK = 'document.querySelector("[data-mark=middle]")?.click()'
TAP = """
  const map = document.getElementById("map"), {left, top} = map.getBoundingClientRect();
  const [x, y] = sara.current.view.toPixel(arguments[0], arguments[1]);
  map.dispatchEvent(new MouseEvent("click", {clientX: left + x, clientY: top + y}));
"""
FIRST = """[
  performance.getEntries().reduce((sum, entry) => sum + (entry.transferSize ?? 0), 0), performance.now(),
]"""  # bytes, ms since the page was asked for
COLOURS = 64  # of a picture's palette


class Camera:
    """Takes SCREEN_SIZE_LANGUAGE.png in each size and language."""

    def __init__(self, page: Page, out: Path) -> None:
        self.page, self.out = page, out

    def take(
        self,
        screen: str,
        pose: Callable[[], None] = lambda: None,
        after: Callable[[], None] = lambda: None,
        name: str = '',
    ) -> None:
        """pose: what to do on the page before each picture; after: and after it. name: of the picture, where it is not
        the screen's.
        """
        for size, window in SIZES.items():
            for language in LANGUAGES:
                self.page.resize(*window)
                self.page.driver.execute_script(
                    'sara.settings.set("language", arguments[0]); location.hash = arguments[1]', language, screen
                )
                self.page.until('document.documentElement.lang === arguments[0]', language)
                self.page.until('sara.shown === arguments[0]', screen)
                time.sleep(0.5)  # the window's new size ends a hold
                pose()
                time.sleep(0.5)  # a few frames of the chair's state, and of the screen
                data = base64.b64decode(self.page.cdp('Page.captureScreenshot', format='png')['data'])
                image = Image.open(io.BytesIO(data)).convert('RGB').quantize(COLOURS, dither=Image.Dither.NONE)
                image.save(self.out / f'{name or screen}_{size}_{language}.png', optimize=True)
                after()


def draw_over(page: Page, camera: Camera) -> None:
    """A wall closes the bathroom, a threshold is slow, and a keep-out place is about to be drawn; they are taken back
    afterwards.
    """
    drawn = (
        {'kind': 'wall', 'points': [[5.55, 3.95], [6.35, 3.95]]},
        {'kind': 'slow', 'points': [[8.6, 3.85], [9.4, 4.05]]},
    )
    page.until('sara.chair.edits !== null', timeout=60.0)
    for edit in drawn:
        page.driver.execute_script('sara.command({op: "edit", ...arguments[0]})', edit)
    page.until('sara.chair.edits?.length === 2')

    def draw() -> None:
        for step in ('[data-edit=begin]', '[data-edit=keep_out]'):
            page.driver.execute_script('document.querySelector(arguments[0]).click()', step)
        for point in ([4.0, 7.0], [6.1, 8.9]):
            page.driver.execute_script(TAP, *point)
        page.driver.execute_script(TOP)

    camera.take('map', pose=draw, name='edit')
    for edit in drawn:
        page.driver.execute_script('sara.command({op: "unedit", ...arguments[0]})', edit)
    page.until('sara.chair.edits?.length === 0')


def story(page: Page, camera: Camera) -> None:
    """A chair that is ready, is on its way, does not back into a wall, and is stopped."""
    page.load('settings')
    page.until('sara.chair.state?.gate?.state === "IDLE"', timeout=120.0)
    camera.take('settings')
    draw_over(page, camera)
    page.driver.execute_script('sara.command({op: "go", place: "bedroom"})')
    page.until('sara.chair.isGoing && sara.chair.state.goal.left < 7', timeout=300.0)
    camera.take('go')
    camera.take('map', pose=lambda: page.driver.execute_script(f'{MARK}; {TOP}'))
    page.driver.execute_script('sara.command({op: "cancel"})')
    page.until('!sara.chair.isMoving', timeout=30.0)

    def back_up() -> None:
        page.mouse('Pressed', *page.middle('.arrow-down'), held=True)
        page.until('!document.getElementById("deviation").hidden', timeout=60.0)
        page.driver.execute_script(TOP)

    camera.take('drive', pose=back_up, after=page.let_go)
    page.driver.execute_script('sara.stopper.press()')
    page.until('sara.chair.isStopped && !sara.chair.isMoving', timeout=30.0)
    page.until('!document.getElementById("reset").hidden')
    camera.take('why')


def main(arguments: Sequence[str] | None = None) -> None:
    """Start chair and browser, take the pictures, end both."""
    images = Path(rospkg.RosPack().get_path('sara_hmi')) / 'docs' / 'images'
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog='touch_pictures', description=__doc__, formatter_class=form)
    parser.add_argument('--out', type=Path, default=images, help='folder (default: %(default)s)')
    out = parser.parse_args(arguments).out
    out.mkdir(parents=True, exist_ok=True)
    with a_node('touch_pictures'), whole_chair('flat', START) as url, browsing(url) as page:
        page.resize(*SIZES['tablet'])
        page.load('go')
        size, usable = page.js(FIRST)
        print(f'first load {size / 1000:.0f} kB; the page can be used {usable / 1000:.2f} s after it is asked for')
        story(page, Camera(page, out))
    sizes = [path.stat().st_size for path in out.glob('*.png')]
    print(f'{len(sizes)} pictures, {sum(sizes) // 1024} kB, in {out}')
