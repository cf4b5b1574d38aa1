// Curves over the scans and over the drive's time (uPlot).
import uPlot from 'uplot'
import { themeColor } from './colors'
import type { Report } from './data'
import { byId, digits, make } from './dom'
import type { Scans } from './scans'

export interface Curve {
  name: string
  color: string // of style.css
  values: ArrayLike<number>
  fill?: boolean | 'solid'
  points?: boolean
}

interface PlotRequest {
  host: HTMLElement
  title: string
  unit: string
  xName: string
  x: ArrayLike<number>
  curves: Curve[]
  onIndex?: (index: number | null) => void
  sync?: string
}

const plots: { request: PlotRequest; made: uPlot }[] = []
let printing = false

function widthOf(host: HTMLElement): number {
  return printing ? 660 : Math.max(200, host.clientWidth)
}

function makePlot(request: PlotRequest): uPlot {
  const ink = themeColor('muted')
  const grid = { stroke: themeColor('line'), width: 1 }
  const font = '12px system-ui, sans-serif'
  const axis = { stroke: ink, grid, ticks: { ...grid, size: 4 }, font, labelFont: font }
  const width = widthOf(request.host)
  const plot = new uPlot(
    {
      width,
      height: width < 500 ? 180 : 210,
      padding: [8, 10, 0, 0],
      cursor: {
        sync: request.sync ? { key: request.sync } : undefined,
        drag: { x: true, y: false },
      },
      legend: { live: true },
      scales: { x: { time: false } },
      axes: [
        { ...axis, label: request.xName, labelSize: 18, size: 30 },
        { ...axis, size: 52, values: (_, ticks) => ticks.map((tick) => digits(tick, 3).replace(/(\.\d*?)0+$/, '$1').replace(/\.$/, '')) },
      ],
      series: [
        { label: request.xName, value: (_, value) => (value == null ? '' : digits(value, 4)) },
        ...request.curves.map(({ name, color, fill, points }) => ({
          label: name,
          stroke: themeColor(color),
          width: points ? 0 : 1.4,
          fill: fill === 'solid' ? themeColor(color) : fill ? `${themeColor(color)}40` : undefined,
          points: points ? { show: true, size: 6, fill: themeColor(color) } : { show: false },
          value: (_: uPlot, value: number | null) => (value == null ? '' : `${digits(value, 3)} ${request.unit}`),
        })),
      ],
      hooks: {
        setCursor: [(u: uPlot) => request.onIndex?.(u.cursor.left! >= 0 ? (u.cursor.idx ?? null) : null)],
      },
    },
    [Array.from(request.x), ...request.curves.map((curve) => Array.from(curve.values))] as uPlot.AlignedData,
    request.host,
  )
  const canvas = request.host.querySelector('canvas')!
  canvas.setAttribute('role', 'img')
  canvas.setAttribute('aria-label', `${request.title}, ${request.unit}, over ${request.xName}. ${summary(request)}`)
  return plot
}

function summary({ curves, unit }: PlotRequest): string {
  return curves
    .map(({ name, values }) => {
      const sorted = Array.from(values).filter(Number.isFinite).sort((a, b) => a - b)
      if (sorted.length === 0) return `${name}: nothing`
      const median = sorted[Math.floor(sorted.length / 2)]
      return `${name}: median ${digits(median)} ${unit}, largest ${digits(sorted.at(-1)!)} ${unit}`
    })
    .join('; ')
}

export function addPlot(
  parent: HTMLElement,
  request: Omit<PlotRequest, 'host'> & { note?: string },
): { replace: (x: ArrayLike<number>, curves: Curve[]) => void } {
  const host = make('div', { class: 'plot' })
  parent.append(
    make(
      'figure',
      { class: 'plot-figure' },
      make('figcaption', {}, make('b', {}, request.title), ` ${request.unit ? `in ${request.unit}` : ''}`, request.note ? make('span', {}, request.note) : ''),
      host,
    ),
  )
  const entry = { request: { ...request, host }, made: makePlot({ ...request, host }) }
  plots.push(entry)
  new ResizeObserver(() => {
    if (!printing && host.clientWidth > 0 && Math.abs(entry.made.width - host.clientWidth) > 1)
      entry.made.setSize({ width: widthOf(host), height: entry.made.height })
  }).observe(host)
  return {
    replace(x, curves) {
      entry.request = { ...entry.request, x, curves }
      remake(entry)
    },
  }
}

function remake(entry: { request: PlotRequest; made: uPlot }) {
  entry.made.destroy()
  entry.made = makePlot(entry.request)
}

/** In the colours that now hold, at a page's width while printing. */
export function remakePlots(forPrint: boolean) {
  printing = forPrint
  for (const entry of plots) remake(entry)
}

/** The direction that is held least in most of the scans, the first one aside: it is matched to nothing. */
function weakestMostOften(names: string[], held: Float32Array[]): string {
  const times = names.map(() => 0)
  for (let i = 1; i < held[0].length; ++i) {
    const shares = held.map((column) => column[i])
    ++times[shares.indexOf(Math.min(...shares))]
  }
  return names[times.indexOf(Math.max(...times))]
}

export function addScanPlots(report: Report, scans: Scans, onScan: (scan: number | null) => void) {
  const parent = byId('scan-plots')
  const x = Array.from({ length: scans.count }, (_, i) => scans.number(i))
  const common = { xName: 'scan', x, onIndex: onScan, sync: 'scans' }
  const rms = scans.column('rms_m')
  if (!rms) {
    byId('scans-summary').textContent =
      'This map folder has no scans.csv, so nothing is known of the single scans; map them again to have it.'
  } else {
    const centimetres = rms.map((value) => 100 * value)
    addPlot(parent, {
      ...common,
      title: 'Residual of the match',
      unit: 'cm',
      note: 'root mean square of the distances between a scan and the scans before it',
      curves: [{ name: 'residual', color: 'curve-1', values: centimetres }],
    })
    addPlot(parent, {
      ...common,
      title: 'Overlap',
      unit: '%',
      note: 'share of a scan\u2019s samples that found a partner in the scans before it',
      curves: [{ name: 'overlap', color: 'curve-2', values: scans.column('overlap')!.map((value) => 100 * value) }],
    })
    const directions = ['x', 'y', 'z', 'roll', 'pitch', 'yaw']
    const held = directions.flatMap((name) => scans.column(`held_${name}`) ?? [])
    if (held.length === directions.length) {
      // The first scan is matched to nothing: shown as the second one.
      const weakest = Float32Array.from(rms, (_, i) => 100 * Math.min(...held.map((column) => column[i === 0 && rms.length > 1 ? 1 : i])))
      addPlot(parent, {
        ...common,
        title: 'Weakest direction',
        unit: '%',
        note: `how well the match holds it; the weakest most often: ${weakestMostOften(directions, held)}`,
        curves: [{ name: 'held', color: 'curve-3', values: weakest }],
      })
    }
    const stage = (name: string) => scans.column(name)!
    const parts = ['reduce_ms', 'store_ms', 'match_ms', 'loop_match_ms', 'loop_share_out_ms'].map(stage)
    // Stacked: each curve is the sum up to it, the widest painted first.
    const sums = parts.map((_, last) =>
      Float32Array.from(parts[0], (_, i) => parts.slice(0, last + 1).reduce((sum, part) => sum + part[i], 0)),
    )
    addPlot(parent, {
      ...common,
      title: 'Time of a scan, by stage',
      unit: 'ms',
      note: 'one upon the other: downsampling, tree and surface, matching, loops',
      curves: [
        { name: '+ loops', color: 'curve-4', values: sums[4], fill: 'solid' },
        { name: '+ matching', color: 'curve-3', values: sums[2], fill: 'solid' },
        { name: '+ tree and surface', color: 'curve-2', values: sums[1], fill: 'solid' },
        { name: 'downsampling', color: 'curve-1', values: sums[0], fill: 'solid' },
      ],
    })
    addPlot(parent, {
      ...common,
      title: 'Iterations of the match',
      unit: '',
      curves: [{ name: 'iterations', color: 'curve-3', values: scans.column('iterations')! }],
    })
    addPlot(parent, {
      ...common,
      title: 'Points kept of a scan',
      unit: '',
      note: 'after downsampling',
      curves: [{ name: 'points', color: 'curve-1', values: scans.column('points')! }],
    })
  }
  if (scans.hasBefore && report.run.loops.some((loop) => loop.accepted))
    addPlot(parent, {
      ...common,
      title: 'Moved by closing loops',
      unit: 'm',
      note: 'from where the scan would be if no loop had been closed',
      curves: [{ name: 'moved by', color: 'curve-4', values: scans.correction, fill: true }],
    })
}
