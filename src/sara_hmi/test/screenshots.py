#!/usr/bin/env python3
"""Makes the pictures of the README: every screen on a tablet and a phone, in both languages, of the simulated chair.

    source devel/setup.bash; .venv/bin/python src/sara_hmi/test/screenshots.py [--out src/sara_hmi/docs/images]

It starts the chair in the flat with a ROS master of its own, drives a short story in headless Chromium, and ends both.
"""

import argparse
import base64
import io
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from PIL import Image

PACKAGE = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(PACKAGE / 'test' / 'browser'))

from browser_page import Page, start_browser  # noqa: E402

SIZES = {'tablet': (1024, 768), 'phone': (390, 844)}
LANGUAGES = ('en', 'es')
TOP = 'document.getElementById("screen").scrollTop = 0'
MARK = 'document.querySelector("[data-mark=middle]")?.click()'
COLOURS = 64  # of a picture's palette


def free_port():
    """A TCP port that nobody listens on."""
    with socket.socket() as found:
        found.bind(('127.0.0.1', 0))
        return found.getsockname()[1]


def start_chair(folder, port):
    """The whole of SARA, simulated in the flat, its page on `port`. Returns the process, a
    group's leader, with its `environment`."""
    master = free_port()
    places = {'ROS_HOME': folder, 'XDG_RUNTIME_DIR': folder, 'ROS_LOG_DIR': f'{folder}/log'}
    flat = PACKAGE.parent / 'sara_bringup' / 'maps' / 'flat.yaml'
    # A copy of the flat, so that nothing that is done on the page changes the maps of this repository.
    for file in flat.parent.glob('flat.*'):
        Path(folder, file.name).write_bytes(file.read_bytes())
    arguments = ['hmi:=true', f'hmi_port:={port}', f'map:={folder}/flat.yaml', 'x:=2.0', 'y:=4.9']
    environment = {**os.environ, **places, 'ROS_MASTER_URI': f'http://localhost:{master}'}
    chair = subprocess.Popen(
        ['roslaunch', '-p', str(master), 'sara_bringup', 'sara.launch', *arguments],
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )
    chair.environment = environment
    return chair


def wait_for_page(port, timeout=60.0):
    """Wait until somebody listens on that port."""
    end = time.monotonic() + timeout
    while time.monotonic() < end:
        with socket.socket() as trial:
            if trial.connect_ex(('127.0.0.1', port)) == 0:
                return
        time.sleep(0.2)
    raise TimeoutError(f'nobody listens on port {port} after {timeout} s')


def end_chair(chair):
    """End roslaunch and what it started."""
    os.killpg(chair.pid, signal.SIGINT)
    try:
        chair.wait(20.0)
    except subprocess.TimeoutExpired:
        os.killpg(chair.pid, signal.SIGKILL)
        chair.wait()


class Camera:
    """Takes a picture in each size and language. `pose`: what to do before each, on the page; `after`: and after it."""

    def __init__(self, page, out):
        self.page, self.out = page, out

    def take(self, screen, pose=lambda: None, after=lambda: None):
        """SCREEN_SIZE_LANGUAGE.png."""
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
                image.save(self.out / f'{screen}_{size}_{language}.png', optimize=True)
                after()


def story(page, camera):
    """A chair that is ready, is on its way, does not back into a wall, and is stopped."""
    page.resize(1024, 768)
    page.load('settings')
    page.until('sara.chair.state?.gate?.state === "IDLE"', timeout=120.0)
    camera.take('settings')
    page.driver.execute_script('sara.command({op: "go", place: "bedroom"})')
    page.until('sara.chair.isGoing && sara.chair.state.goal.left < 7', timeout=60.0)
    camera.take('go')
    camera.take('map', pose=lambda: page.driver.execute_script(f'{MARK}; {TOP}'))
    page.driver.execute_script('sara.command({op: "cancel"})')
    page.until('!sara.chair.isMoving', timeout=30.0)

    def back_up():
        page.mouse('Pressed', *page.middle('.arrow-down'), held=True)
        page.until('!document.getElementById("deviation").hidden', timeout=60.0)
        page.driver.execute_script(TOP)

    camera.take('drive', pose=back_up, after=page.let_go)
    page.driver.execute_script('sara.stopper.press()')
    page.until('sara.chair.isStopped && !sara.chair.isMoving', timeout=30.0)
    page.until('!document.getElementById("reset").hidden')
    camera.take('why')


def main():
    """Start chair and browser, take the pictures, end both."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--out', type=Path, default=PACKAGE / 'docs' / 'images')
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    port = free_port()
    with tempfile.TemporaryDirectory(prefix='sara_hmi_') as folder:
        chair = start_chair(folder, port)
        browser = start_browser(f'{folder}/browser')
        try:
            wait_for_page(port)
            page = Page(browser, None, f'http://127.0.0.1:{port}')
            story(page, Camera(page, out))
        finally:
            browser.quit()
            end_chair(chair)
    total = sum(path.stat().st_size for path in out.glob('*.png'))
    print(f'{len(list(out.glob("*.png")))} pictures, {total // 1024} kB, in {out}')


if __name__ == '__main__':
    main()
