def test_loads(page):
    page.load('drive')
    x, y = page.middle('#stick')
    page.mouse('Pressed', x, y, held=True)
    page.mouse('Moved', x, y - 60, held=True)
    page.chair.wait_for('drive', count=3)
    page.mouse('Released', x, y - 60)
    page.chair.wait_for('halt')
    print(page.chair.frames('drive', 'halt', 'take'))
