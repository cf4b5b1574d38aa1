// The drive: what the devices said on a time line, and how their counters grew.
import type { Notice, Report } from './data'
import { byId, digits, duration, make, makeSvg, roundStep, table, whole } from './dom'
import { addPlot } from './plots'
import type { Scans } from './scans'

const order = ['error', 'warning', 'info']

function symbol(severity: string, x: number, y: number, title: string): SVGElement {
  const shape =
    severity === 'error'
      ? makeSvg('path', { d: `M${x} ${y - 6}l6 6-6 6-6-6z` })
      : severity === 'warning'
        ? makeSvg('path', { d: `M${x} ${y - 6}l6 11h-12z` })
        : makeSvg('circle', { cx: x, cy: y, r: 3.5 })
  shape.setAttribute('class', `notice-${severity}`)
  shape.append(makeSvg('title', {}, title))
  return shape
}

function drawTimeLine(report: Report, scans: Scans, host: HTMLElement) {
  const drive = report.run.drive!
  const notices = drive.notices ?? []
  const sources = [...new Set(notices.map((notice) => notice.source))]
  const width = Math.max(300, host.clientWidth)
  const left = width < 520 ? 74 : 96
  const end = Math.max(drive.duration_s ?? 0, ...notices.map((notice) => notice.last_s), 1)
  const x = (time: number) => left + ((width - left - 12) * time) / end
  const lane = 26
  const stamps = scans.column('stamp')!
  // The scans' stamps are those of the vehicle's clock, counted from the first scan; the drive began before it.
  const firstScan = report.has_time ? offsetOfFirstScan(report) : null
  const lanes = firstScan === null ? sources : ['loops', ...sources]
  const height = lane * lanes.length + 34
  const svg = makeSvg('svg', { viewBox: `0 0 ${width} ${height}`, width, height, role: 'img',
    'aria-label': `Time line of ${duration(end)}; the notices are listed below` })
  const step = roundStep(end / (width < 520 ? 3 : 6))
  for (let time = 0; time <= end; time += step) {
    svg.append(
      makeSvg('line', { x1: x(time), x2: x(time), y1: 0, y2: height - 22, class: 'grid' }),
      makeSvg('text', { x: x(time), y: height - 6, 'text-anchor': 'middle' }, digits(time, 4).replace(/\.0+$/, '') + ' s'),
    )
  }
  lanes.forEach((name, i) => {
    const y = lane * i + lane / 2
    svg.append(makeSvg('line', { x1: left, x2: width - 12, y1: y, y2: y, class: 'lane' }))
    svg.append(makeSvg('text', { x: left - 10, y: y + 4, 'text-anchor': 'end' }, name))
    if (firstScan !== null && i === 0) {
      report.run.loops.forEach((loop, index) => {
        const at = firstScan + stamps[loop.last]
        const mark = makeSvg('circle', { cx: x(at), cy: y, r: 4, class: loop.accepted ? 'loop-closed' : 'loop-refused' })
        mark.append(makeSvg('title', {}, `${digits(at, 4)} s: loop ${index + 1} ${loop.accepted ? 'closed' : 'refused'}`))
        svg.append(mark)
      })
      return
    }
    const ofSource = notices.filter((notice) => notice.source === name)
    ofSource.sort((a, b) => order.indexOf(b.severity) - order.indexOf(a.severity))
    for (const notice of ofSource)
      for (const at of timesOf(notice))
        svg.append(symbol(notice.severity, x(at), y, `${digits(at, 4)} s, ${name}: ${notice.text}`))
  })
  host.replaceChildren(svg)
}

function timesOf(notice: Notice): number[] {
  return notice.at_s?.length ? notice.at_s : notice.times > 1 ? [notice.first_s, notice.last_s] : [notice.first_s]
}

/** Seconds from the drive's begin to the first scan. */
function offsetOfFirstScan(report: Report): number | null {
  const begin = report.run.drive?.begin_s
  return begin === undefined || report.first_stamp_s === undefined ? null : report.first_stamp_s - begin
}

export function addDrive(report: Report, scans: Scans) {
  const { drive } = report.run
  if (!drive) {
    byId('drive').hidden = true
    document.querySelector('nav a[href="#drive"]')?.remove()
    return
  }
  const notices = drive.notices ?? []
  const count = (severity: string) => notices.filter((n) => n.severity === severity).reduce((sum, n) => sum + n.times, 0)
  byId('drive-summary').textContent =
    `${duration(drive.duration_s ?? 0)}, ${whole(drive.events ?? 0)} events. ` +
    `${count('error')} errors, ${count('warning')} warnings, ${count('info')} messages.`
  const host = byId('time-line')
  drawTimeLine(report, scans, host)
  let width = host.clientWidth
  new ResizeObserver(() => {
    if (host.clientWidth === width || host.clientWidth === 0) return
    width = host.clientWidth
    drawTimeLine(report, scans, host)
  }).observe(host)
  const sorted = [...notices].sort(
    (a, b) => order.indexOf(a.severity) - order.indexOf(b.severity) || a.first_s - b.first_s,
  )
  byId('notices').append(
    make('div', { class: 'scroll' },
      table(
        ['', 'Who', 'What', 'times', 'first', 'last'],
        sorted.map((n) => [
          make('span', { class: `word-${n.severity}` }, n.severity), n.source, n.text, whole(n.times),
          `${n.first_s.toFixed(1)} s`, n.times > 1 ? `${n.last_s.toFixed(1)} s` : '',
        ]),
        [3, 4, 5],
      )),
  )
  addCounters(report)
}

function addCounters(report: Report) {
  const groups = Object.entries(report.run.drive?.counters ?? {})
  const host = byId('counter-tables')
  for (const [part, counters] of groups) {
    const counted = Object.entries(counters).filter(([, value]) => value !== 0)
    const zeros = Object.keys(counters).length - counted.length
    host.append(
      make('div', { class: 'counter-group' }, make('h4', {}, part.replaceAll('_', ' ')),
        table(['', ''], counted.map(([name, value]) => [name.replaceAll('_', ' '), whole(value)]), [1]),
        make('small', {}, zeros > 0 ? `${zeros} others are 0` : '')),
    )
  }
  const history = report.counters
  if (!history || history.time_s.length < 2) return
  const select = make('select', { id: 'counter-choice' })
  for (const [part] of groups) {
    const options = history.names.map((name, i) => ({ name, i })).filter(({ name }) => name.startsWith(`${part}.`))
    if (options.length === 0) continue
    select.append(
      make('optgroup', { label: part.replaceAll('_', ' ') },
        ...options.map(({ name, i }) => make('option', { value: String(i) }, `${part.replaceAll('_', ' ')}: ${name.slice(part.length + 1).replaceAll('_', ' ')}`))),
    )
  }
  const choose = byId('counter-plot')
  choose.append(make('p', {}, make('label', { for: 'counter-choice' }, 'A counter over the drive: '), select))
  // The first one shown is the one that says most: a few steps, not a steady stream.
  const steps = history.values.map((values) => values.filter((v, i) => i > 0 && v !== values[i - 1]).length)
  const telling = steps.map((n, i) => ({ n, i })).filter(({ n }) => n > 1 && n < 0.5 * history.time_s.length)
  const first = telling.sort((a, b) => b.n - a.n)[0]?.i ?? 0
  select.value = String(first)
  const curves = (i: number) => [{ name: history.names[i].replace('.', ': ').replaceAll('_', ' '), color: 'curve-1', values: history.values[i], fill: true }]
  const plot = addPlot(choose, { title: 'Counted since the begin', unit: '', xName: 'time of the drive, s', x: history.time_s, curves: curves(first) })
  select.addEventListener('change', () => plot.replace(history.time_s, curves(Number(select.value))))
}
