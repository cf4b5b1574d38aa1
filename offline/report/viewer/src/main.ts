// The page of `alces report`: reads what the program put in, and brings its sections to life.
import 'uplot/dist/uPlot.min.css'
import './style.css'
import type { ColorMode } from './colors'
import { readReport, Report } from './data'
import { byId, bytes, digits, duration, make, metres, millions, table, whole } from './dom'
import { addDrive } from './drive'
import { LoopsSection, press } from './loops'
import { addScanPlots, remakePlots } from './plots'
import { addResources } from './resources'
import { Scans } from './scans'
import { Viewer, viewerHelp } from './viewer'

/** "poses optimized by LUM, 12 iterations, 15 s"; empty for a map as it was driven. */
function optimizedBy({ run: { optimize } }: Report): string {
  if (!optimize?.with) return ''
  const names: Record<string, string> = { gn: 'Gauss-Newton', elch: 'ELCH', toro: 'TORO', hogman: 'HOG-Man', lum: 'LUM' }
  return [
    `poses optimized by ${names[optimize.with] ?? optimize.with}`,
    optimize.iterations === undefined ? '' : `${whole(optimize.iterations)} iterations`,
    optimize.seconds === undefined ? '' : duration(optimize.seconds),
    optimize.complete === false ? 'stopped early' : '',
  ]
    .filter(Boolean)
    .join(', ')
}

function addHeader(report: Report, scans: Scans) {
  const { run } = report
  const closed = run.loops.filter((loop) => loop.accepted).length
  byId('source').textContent = [run.source?.description, optimizedBy(report)].filter(Boolean).join('; ')
  const figure = (value: string, name: string) => make('div', {}, make('dd', {}, value), make('dt', {}, name))
  const figures = [
    figure(whole(report.scans), 'scans'),
    figure(millions(report.cloud.points), 'points'),
    figure(run.length_m === undefined ? '–' : `${whole(run.length_m)} m`, 'driven'),
    figure(`${closed}`, closed === 1 ? 'loop closed' : 'loops closed'),
    figure(`${run.loops.length - closed}`, 'refused'),
  ]
  if (scans.hasBefore && closed > 0) figures.push(figure(metres(scans.largestCorrection), 'largest correction'))
  if (run.times?.mapping_s) figures.push(figure(duration(run.times.mapping_s), 'to map'))
  if (run.memory?.block_bytes) figures.push(figure(bytes(run.memory.block_bytes), 'of memory'))
  byId('figures').append(...figures)
  if (run.complete === false) {
    byId('incomplete').hidden = false
    byId('incomplete').textContent = `The map ends early: ${run.stopped_by ?? 'its run was stopped'}.`
  }
}

/** What the map is worth, why, and the scans to look at: a click marks one in the map. */
function addVerdict({ run: { verdict, health } }: Report, scans: Scans, viewer: Viewer) {
  if (typeof verdict !== 'string') return
  const host = byId('verdict')
  host.hidden = false
  if (['good', 'doubtful', 'bad'].includes(verdict)) host.classList.add(`verdict-${verdict}`)
  const parts = health?.parts ?? 1
  host.append(make('b', {}, `The map is ${verdict}`), `: ${health?.doubt ?? 'no reason is given'}`, parts > 1 ? `; ${whole(parts)} parts` : '')
  const weakest = verdict !== 'good' && Array.isArray(health?.weakest_scans) ? health.weakest_scans : []
  const rowOf = new Map(Array.from({ length: scans.count }, (_, row) => [scans.number(row), row]))
  weakest.forEach((number, i) => {
    const row = rowOf.get(Math.fround(number))
    const mark = make('a', { href: '#map' }, `${number}`)
    if (row !== undefined) mark.addEventListener('click', () => viewer.highlightScan(row))
    host.append(i === 0 ? '; look at scans ' : ', ', row === undefined ? `${number}` : mark)
  })
  host.append('.')
}

function addMap(report: Report, scans: Scans): Viewer {
  const host = byId('viewer')
  // ?draw=canvas, ?draw=webgl: for trying out what another browser would do
  const viewer = new Viewer(host, report, scans, new URLSearchParams(location.search).get('draw'))
  const { cloud } = report
  const showLegend = () => {
    const { title, low, high, gradient } = viewer.legend()
    byId('legend-title').textContent = title
    byId('legend-low').textContent = low
    byId('legend-high').textContent = high
    byId('legend-bar').style.background = gradient
  }
  for (const button of document.querySelectorAll<HTMLButtonElement>('#color-mode button')) {
    const mode = button.dataset.value as ColorMode
    if (mode === 'correction' && scans.largestCorrection === 0) {
      button.disabled = true
      button.title = 'No loop was closed, or the map folder does not say what closing them changed'
    }
    if (mode === 'intensity') button.hidden = !cloud.has_intensity
    button.addEventListener('click', () => {
      press('#color-mode button', button)
      viewer.setMode(mode)
      showLegend()
    })
  }
  const undo = byId<HTMLInputElement>('undo')
  const undoLabel = byId('undo-state')
  if (scans.largestCorrection === 0) byId('undo-box').hidden = true
  undo.addEventListener('input', () => {
    const share = 1 - Number(undo.value) / 100
    viewer.setUndo(share)
    undoLabel.textContent = share === 0 ? 'closed' : share === 1 ? 'not closed' : 'in between'
  })
  const beforeBox = byId<HTMLInputElement>('show-before')
  if (!scans.hasBefore) beforeBox.closest('label')!.hidden = true
  for (const what of ['after', 'before', 'loops'] as const) {
    const box = byId<HTMLInputElement>(`show-${what}`)
    viewer.setShown(what, box.checked)
    box.addEventListener('change', () => viewer.setShown(what, box.checked))
  }
  byId<HTMLInputElement>('point-size').addEventListener('input', (event) =>
    viewer.setPointScale(Number((event.target as HTMLInputElement).value)),
  )
  byId('zoom-in').addEventListener('click', () => viewer.zoom(0.7))
  byId('zoom-out').addEventListener('click', () => viewer.zoom(1 / 0.7))
  byId('all').addEventListener('click', () => viewer.home())
  byId('viewer-help').append(viewerHelp)
  const left = cloud.points_shown < cloud.points - cloud.points_left_out
  byId('cloud-note').textContent =
    `${left ? `${millions(cloud.points_shown)} of ${millions(cloud.points)} points` : `All ${millions(cloud.points_shown)} points`}, ` +
    `to ${digits(cloud.step_m * 500, 2)} mm an axis` +
    (left ? ' (alces report --full keeps all)' : '') +
    (cloud.points_left_out > 0 ? `; ${whole(cloud.points_left_out)} points that are not finite or far off are left out` : '') +
    (viewer.painter.kind === 'canvas' ? '. Drawn without WebGL, which this browser does not have or only computes' : '') +
    '.'
  viewer.onLegend = showLegend
  return viewer
}

function addComparison(report: Report) {
  const { comparison } = report
  if (!comparison) return
  const host = byId('comparison')
  host.hidden = false
  for (const one of comparison.tables) {
    const numeric = one.columns.map((_, i) => i).filter((i) => one.rows.every((row) => row[i] === '' || !Number.isNaN(Number(row[i]))))
    host.append(make('h3', {}, one.name.replaceAll('_', ' ')), make('div', { class: 'scroll' }, table(one.columns, one.rows, numeric)))
  }
  const pictures = make('div', { class: 'pictures' })
  for (const { name, href } of comparison.pictures)
    pictures.append(make('figure', {}, make('img', { src: href, alt: name.replaceAll('_', ' ') }), make('figcaption', {}, name.replaceAll('_', ' '))))
  host.append(pictures)
}

function addDetails(report: Report) {
  const { run } = report
  const host = byId('details-body')
  const warnings = run.warnings ?? []
  byId('warnings').append(
    warnings.length === 0 ? make('p', {}, 'None.') : make('ul', {}, ...warnings.map((text) => make('li', {}, text))),
  )
  const facts: [string, string][] = [
    ['Made by', `${run.program?.name ?? 'alces'} ${run.program?.version ?? ''}`],
    ['Called as', (run.program?.command_line ?? []).join(' ')],
    ['Front end', run.front_end ?? ''],
  ]
  host.append(make('div', { class: 'scroll' }, table(['', ''], facts.filter(([, value]) => value.trim() !== ''))))
  const rows = (values: Record<string, unknown>) =>
    Object.entries(values).map(([name, value]) => [name, typeof value === 'number' ? String(value) : JSON.stringify(value)])
  const groups = make('div', { class: 'counter-groups' })
  if (run.counters)
    groups.append(make('div', { class: 'counter-group' }, make('h4', {}, 'counters'),
      table(['', ''], Object.entries(run.counters).map(([name, value]) => [name.replaceAll('_', ' '), whole(value)]), [1])))
  for (const [name, values] of Object.entries(run.settings ?? {}))
    if (values && typeof values === 'object')
      groups.append(make('div', { class: 'counter-group' }, make('h4', {}, name.replaceAll('_', ' ')), table(['', ''], rows(values), [1])))
  host.append(groups)
}

function followPrintAndTheme(loops: LoopsSection) {
  addEventListener('beforeprint', () => {
    document.documentElement.classList.add('printing')
    for (const details of document.querySelectorAll<HTMLDetailsElement>('details[data-print]')) details.open = true
    remakePlots(true)
    loops.redraw()
  })
  addEventListener('afterprint', () => {
    document.documentElement.classList.remove('printing')
    remakePlots(false)
    loops.redraw()
  })
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
    remakePlots(false)
    loops.redraw()
  })
}

async function start() {
  const report = readReport()
  const scans = await Scans.read(report)
  addHeader(report, scans)
  const viewer = addMap(report, scans)
  addVerdict(report, scans, viewer)
  document.documentElement.classList.add('alive')
  const loops = new LoopsSection(report, scans, () => viewer.allNodes())
  const select = (index: number, goThere: boolean) => {
    loops.select(index)
    viewer.selectLoop(index, goThere)
  }
  viewer.onLoop = (index) => select(index, true)
  loops.onSelect = (index) => select(index, true)
  addScanPlots(report, scans, (scan) => viewer.highlightScan(scan))
  addResources(report, scans)
  addDrive(report, scans)
  addComparison(report)
  addDetails(report)
  followPrintAndTheme(loops)
  const bar = byId<HTMLProgressElement>('loading')
  await viewer.load((share) => (bar.value = share))
  bar.hidden = true
  // The loop that moved the most says most.
  const largest = report.run.loops.reduce(
    (best, loop, i, all) => (loop.accepted && (loop.correction_m ?? 0) > (all[best]?.correction_m ?? -1) ? i : best),
    -1,
  )
  if (report.run.loops.length > 0) {
    loops.select(Math.max(largest, 0))
    viewer.selectLoop(Math.max(largest, 0), false)
  }
  return viewer
}

declare global {
  interface Window {
    /** For tests: the viewer once all points are there. */
    alcesReport: Promise<Viewer>
  }
}

window.alcesReport = start()
window.alcesReport.catch((problem: unknown) => {
  const missing = typeof DecompressionStream === 'undefined'
  byId('problem').hidden = false
  byId('problem').textContent = missing
    ? 'This browser is too old for the report: it needs one of 2023 or later. The picture below is the map from above.'
    : `The report cannot be shown: ${String(problem)}. The picture below is the map from above.`
  if (!missing) console.error(problem)
})
