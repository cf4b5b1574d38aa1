// node check_page.mjs ALCES WORK: a report of a small map in a real browser: it loads without a complaint or a request, its points
// are drawn, loops are chosen by mouse and by keys, it fits 1280 and 400 pixels, it prints, and it is of use without WebGL and
// without JavaScript. Screenshots are left in WORK.
import assert from 'node:assert/strict'
import { spawnSync } from 'node:child_process'
import { rmSync, statSync } from 'node:fs'
import { join } from 'node:path'
import { openBrowser, watch } from './browser.mjs'
import { makeMap } from './make_map.mjs'

const [alces, work] = process.argv.slice(2)
const map = makeMap(join(work, 'map'))
const html = join(work, 'map.html')
const made = spawnSync(alces, ['report', join(work, 'map'), '--out', html], { encoding: 'utf8' })
if (made.status === 5 && made.stderr.includes('built without the page')) {
  console.log(`skipped: ${made.stderr.trim()}`)
  process.exit(77)
}
assert.equal(made.status, 0, made.stderr)
assert.ok(statSync(html).size < 25e6)
const url = `file://${html}`
// Chromium without an accelerator would choose the plain canvas by itself.
const withWebGl = `${url}?draw=webgl`

let passed = 0
async function check(what, body) {
  await body()
  ++passed
  console.log(`ok: ${what}`)
}

const { context, profile } = await openBrowser(work, { viewport: { width: 1280, height: 900 } })
try {
  const page = await context.newPage()
  const complaints = watch(page)
  await page.goto(withWebGl)
  await page.evaluate(() => window.alcesReport.then(() => true))

  /** However slow the machine: until the map stands and all its points are drawn. */
  const settle = () =>
    page.evaluate(async () => {
      const viewer = await window.alcesReport
      for (let calm = 0; calm < 3; calm = viewer.isSettled ? calm + 1 : 0) await new Promise((resume) => setTimeout(resume, 50))
    })
  /** Pixels of the map that are not ground, and a sum over all. */
  const drawn = async () => {
    await settle()
    return page.evaluate(() => {
      const from = document.querySelector('canvas.points')
      const copy = new OffscreenCanvas(from.width, from.height)
      const ink = copy.getContext('2d')
      ink.drawImage(from, 0, 0)
      const { data } = ink.getImageData(0, 0, copy.width, copy.height)
      let count = 0
      let sum = 0
      for (let i = 0; i < data.length; i += 4) {
        if (data[i] + data[i + 1] + data[i + 2] > 120) ++count
        sum = (sum * 31 + data[i] + 7 * data[i + 1] + 13 * data[i + 2]) % 1000000007
      }
      return { count, sum }
    })
  }
  const selected = () => page.evaluate(() => document.querySelector('#loop-list [aria-selected=true]')?.id ?? null)
  const fits = () => page.evaluate(() => document.documentElement.scrollWidth <= document.documentElement.clientWidth)

  await check('all points are unpacked, and WebGL draws them', async () => {
    const { points, kind } = await page.evaluate(async () => {
      const viewer = await window.alcesReport
      return { points: viewer.points, kind: viewer.painter.kind }
    })
    assert.equal(points, map.points)
    assert.equal(kind, 'webgl')
    assert.ok((await drawn()).count > 5000)
  })

  await check('the header says that the poses were optimized afterwards, and how', async () => {
    assert.equal(await page.locator('#source').innerText(), 'a drive made of numbers; poses optimized by LUM, 12 iterations, 15.1 s')
  })

  await check('the head says what the map is worth, and marks the scans to look at', async () => {
    assert.equal(await page.locator('#verdict').innerText(), 'The map is doubtful: scans <b>do not fit</b>; look at scans 17, 4, 999.')
    assert.equal(await page.locator('#verdict a').count(), 2)  // the map has no scan 999
    await settle()
    const overlay = () => page.evaluate(async () => (await window.alcesReport).scan)
    await page.locator('#verdict a').first().click()
    assert.equal(await overlay(), 16)  // its row
    await page.evaluate(async () => (await window.alcesReport).highlightScan(null))
  })

  await check('what recordings say is text, never markup', async () => {
    assert.equal(await page.locator('img[src=x]').count(), 0)
    assert.ok((await page.locator('#notices').innerText()).includes('<img src=x onerror=alert(1)>'))
    assert.ok((await page.locator('#details-body').textContent()).includes('</script><b>drive</b>.mcap'))
  })

  await check('the loop that moved most is shown first; its two visits are drawn differently before and after', async () => {
    assert.equal(await selected(), 'loop-0')
    const [before, after] = await page.evaluate(() =>
      ['before', 'after'].map((which) => document.getElementById(`overlap-${which}`).toDataURL()))
    assert.ok(before.length > 3000)
    assert.notEqual(before, after)
  })

  await check('a click on an arc chooses its loop', async () => {
    await page.locator('#viewer').scrollIntoViewIfNeeded()
    await settle()
    const [x, y] = await page.evaluate(async () => (await window.alcesReport).arcTop(2))
    const box = await page.locator('#viewer').boundingBox()
    await page.mouse.click(box.x + x, box.y + y)
    assert.equal(await selected(), 'loop-2')
  })

  await check('N and P step through the loops from the map, up and down through the list', async () => {
    await page.locator('#viewer').focus()
    await page.keyboard.press('n')
    assert.equal(await selected(), 'loop-0')
    await page.keyboard.press('p')
    assert.equal(await selected(), 'loop-2')
    await page.locator('#loop-list').focus()
    await page.keyboard.press('ArrowUp')
    assert.equal(await selected(), 'loop-1')
    assert.match(await page.locator('#announcer').textContent(), /Refused: too little overlap/)
    assert.equal(await page.locator('#loop-list').getAttribute('aria-activedescendant'), 'loop-1')
  })

  await check('keys turn, move and zoom the map', async () => {
    await page.locator('#viewer').focus()
    let last = await drawn()
    for (const key of ['ArrowLeft', 'ArrowUp', 'Shift+ArrowRight', '+', 'Home']) {
      await page.keyboard.press(key)
      const now = await drawn()
      assert.notEqual(now.sum, last.sum, key)
      last = now
    }
  })

  await check('colours, and the map as if no loop were closed', async () => {
    const last = await drawn()
    await page.locator('#color-mode [data-value=correction]').click()
    const colored = await drawn()
    assert.notEqual(colored.sum, last.sum)
    assert.match(await page.locator('#legend-high').textContent(), /m$/)
    await page.locator('#undo').focus()
    await page.keyboard.press('Home')
    assert.equal(await page.locator('#undo-state').textContent(), 'not closed')
    assert.notEqual((await drawn()).sum, colored.sum)
    await page.keyboard.press('End')
    await page.locator('#color-mode [data-value=intensity]').click()
    assert.notEqual((await drawn()).sum, colored.sum)
    assert.equal(await page.locator('#legend-title').textContent(), 'intensity')
    await page.locator('#color-mode [data-value=correction]').click()
  })

  await check('Tab reaches the parts in the order they are read', async () => {
    const order = await page.evaluate(() =>
      [...document.querySelectorAll('a[href], button, input, select, summary, [tabindex="0"]')]
        .filter((element) => element.offsetParent !== null && element.tabIndex >= 0)
        .map((element) => element.id))
    for (const [earlier, later] of [['undo', 'viewer'], ['viewer', 'loop-list'], ['loop-list', 'overlap-before'], ['overlap-after', 'counter-choice']])
      assert.ok(order.indexOf(earlier) >= 0 && order.indexOf(earlier) < order.indexOf(later), `${earlier}, ${later}`)
    assert.equal(await page.evaluate(() => [...document.querySelectorAll('button')].filter((b) => !(b.innerText || b.ariaLabel)).length), 0)
  })

  await check('1280 and 400 pixels are wide enough', async () => {
    assert.ok(await fits())
    await page.screenshot({ path: join(work, 'wide.png'), fullPage: true })
    await page.setViewportSize({ width: 400, height: 800 })
    await page.waitForTimeout(300)
    assert.ok(await fits())
    assert.ok((await drawn()).count > 1000)
    await page.screenshot({ path: join(work, 'narrow.png'), fullPage: true })
    await page.setViewportSize({ width: 1280, height: 900 })
  })

  await check('a dark scheme is followed', async () => {
    const ground = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor)
    const light = await ground()
    await page.emulateMedia({ colorScheme: 'dark' })
    assert.notEqual(await ground(), light)
    await page.waitForTimeout(300)
    await page.screenshot({ path: join(work, 'dark.png'), fullPage: true })
  })

  await check('it prints, light and with the map as a picture', async () => {
    const pdf = await page.pdf({ path: join(work, 'print.pdf'), format: 'A4' })
    assert.equal(pdf.subarray(0, 5).toString(), '%PDF-')
    assert.ok(pdf.length > 50000)
    await page.emulateMedia({ media: 'print', colorScheme: 'light' })
    assert.ok(await page.locator('.static-map svg').isVisible())
    assert.ok(!(await page.locator('#viewer').isVisible()))
    await page.emulateMedia({ media: null })
  })

  await check('without WebGL the points are drawn all the same', async () => {
    await page.goto(url)
    assert.equal(await page.evaluate(async () => (await window.alcesReport).painter.kind), 'canvas')
    assert.ok((await drawn()).count > 2000)
  })

  await check('no complaint, and no request but for the file itself', () => assert.deepEqual(complaints, []))
  await context.close()

  await check('without JavaScript the map is there from above', async () => {
    const plain = await openBrowser(work, { javaScriptEnabled: false })
    const still = await plain.context.newPage()
    await still.goto(url)
    assert.ok(await still.locator('.static-map svg').isVisible())
    assert.ok(!(await still.locator('#viewer').isVisible()))
    await plain.context.close()
    rmSync(plain.profile, { recursive: true, force: true })
  })
} finally {
  await context.close().catch(() => {})
  rmSync(profile, { recursive: true, force: true, maxRetries: 3 })
}
console.log(`${passed} passed, 0 failed`)
