"""The page with a fake chair behind it."""

from fake_chair import SESSION

from sara_hmi.browser.page import Page


class ChairPage(Page):
    """chair: the FakeChair."""

    def __init__(self, driver, chair):
        super().__init__(driver, f'http://127.0.0.1:{chair.port}')
        self.chair = chair

    def load(self, screen='go', role='rider', **settings):
        """Load the page with these settings as this role; wait until it is connected."""
        self.chair.reset()
        self.chair.role = role
        super().load(screen, **settings)
        self.limits(20_000, 20_000, 20_000)
        return self

    def limits(self, stale_beat_ms=200, slow_ms=180, frozen_ms=300, silent_ms=20_000, lost_ms=60_000):
        """What the page takes for a lost, a slow or a silent connection. It is patient until a test wants less, so that
        a busy machine is not taken for a slow network.
        """
        self.driver.execute_script(
            'Object.assign(sara.connection.limits, {staleBeatMs: arguments[0], slowMs: arguments[1]});'
            'Object.assign(sara.connection.limits, {silentMs: arguments[3], lostMs: arguments[4]});'
            'sara.pump.frozenMs = arguments[2]',
            stale_beat_ms,
            slow_ms,
            frozen_ms,
            silent_ms,
            lost_ms,
        )

    def controls(self):
        """Give the page the controls, and wait for a beat: what is pressed drives at once."""
        self.chair.state['driver'] = SESSION
        self.until('sara.chair.isDriver && sara.connection.hasBeat')

    def until_painted(self):
        """Wait until the map is drawn, as far off as it is looked at from."""
        self.until(
            'sara.chair.image !== null && sara.current.view.fitted && document.getElementById("map").width > 300'
        )

    def round_trip(self):
        """Wait until the page's timers have run a few times and all that it sent before has come to the fake chair."""
        self.driver.execute_async_script(
            'const done = arguments[0]; let k = 4;const tick = () => (--k ? setTimeout(tick, 50) : done(true)); tick();'
        )
        asked = self.until('(sara.connection.askedAt = null, sara.connection.ask(), sara.connection.askedAt)')
        self.chair.wait(lambda: any(abs(frame['t'] - asked) < 1e-3 for frame in self.chair.frames('echo')))
