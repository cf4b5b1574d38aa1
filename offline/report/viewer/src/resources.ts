// Where the time and the memory went, against what was planned.
import type { Report } from './data'
import { byId, bytes, digits, duration, make, table } from './dom'
import type { Scans } from './scans'

interface Part {
  name: string
  value: number
  color: string
}

function stackedBar(parts: Part[], total: number, format: (value: number) => string, label: string): HTMLElement {
  const share = (value: number) => `${(100 * value) / Math.max(total, 1e-12)}%`
  return make(
    'div',
    { class: 'stack', role: 'img', 'aria-label': `${label}: ${parts.map((p) => `${p.name} ${format(p.value)}`).join(', ')}` },
    make('div', { class: 'stack-bar' }, ...parts.map((part) => make('i', { style: `width:${share(part.value)};background:var(--${part.color})` }))),
    make(
      'ul',
      { class: 'keys' },
      ...parts.map((part) =>
        make('li', {}, make('i', { style: `background:var(--${part.color})` }), `${part.name} `, make('b', {}, format(part.value))),
      ),
    ),
  )
}

function timePart(report: Report, scans: Scans, host: HTMLElement) {
  const { times } = report.run
  if (!times?.front_end) return
  const total = (key: string): number => times[key]?.total_s ?? 0
  const written = Object.values((times.write_s ?? {}) as Record<string, number>).reduce((sum, s) => sum + s, 0)
  const parts = [
    { name: 'waiting for scans', value: times.read_wait_s ?? 0, color: 'muted-fill' },
    { name: 'downsampling', value: total('reduce'), color: 'curve-1' },
    { name: 'tree and surface', value: total('store'), color: 'curve-2' },
    { name: 'matching', value: total('match'), color: 'curve-3' },
    { name: 'loops', value: total('detect') + total('loop_match') + total('loop_share_out'), color: 'curve-4' },
    { name: 'writing the map', value: written, color: 'curve-5' },
  ]
  const sum = parts.reduce((whole, part) => whole + part.value, 0)
  host.append(make('h3', {}, `Time: ${duration(sum)}`), stackedBar(parts, sum, duration, 'Time'))
  const stamps = scans.column('stamp')!
  if (report.has_time && scans.count > 1) {
    const intervals = Array.from(stamps.slice(1), (stamp, i) => stamp - stamps[i]).sort((a, b) => a - b)
    const interval = intervals[Math.floor(intervals.length / 2)]
    const worst = times.front_end.worst_ms / 1e3
    host.append(
      make('p', {}, `A scan came every ${duration(interval)}; matching it took ${duration(times.front_end.median_ms / 1e3)} ` +
        `(median), ${duration(worst)} at worst: ${digits((100 * worst) / interval, 2)} % of the time there was.`),
    )
  }
  const stages: [string, string][] = [
    ['front_end', 'Front end, a scan'],
    ['reduce', 'downsampling'],
    ['store', 'tree and surface'],
    ['match', 'matching'],
    ['detect', 'looking for loops'],
    ['loop_match', 'Loop matching, a loop'],
    ['loop_share_out', 'sharing out'],
  ]
  host.append(
    make('div', { class: 'scroll' },
      table(
        ['Stage', 'median', 'worst', 'in all'],
        stages
          .filter(([key]) => times[key])
          .map(([key, name]) => [name, `${digits(times[key].median_ms)} ms`, `${digits(times[key].worst_ms)} ms`, duration(times[key].total_s)]),
        [1, 2, 3],
      )),
  )
}

function memoryPart(report: Report, host: HTMLElement) {
  const { memory } = report.run
  if (!memory?.block_bytes) return
  const used = Math.min(memory.pool_used_bytes ?? 0, memory.pool_bytes)
  const parts = [
    { name: 'pool, used', value: used, color: 'curve-2' },
    { name: 'pool, free', value: memory.pool_bytes - used, color: 'muted-fill' },
    { name: 'poses and edges', value: memory.scans_bytes, color: 'curve-1' },
    { name: 'cache', value: memory.cache_bytes, color: 'curve-3' },
    { name: 'working memory', value: memory.working_bytes, color: 'curve-4' },
  ]
  host.append(
    make('h3', {}, `Memory: one block of ${bytes(memory.block_bytes)}`),
    stackedBar(parts, memory.block_bytes, bytes, 'Memory'),
    make('p', {},
      `Planned before the first scan, taken once, never exceeded. ${digits((100 * used) / memory.pool_bytes, 2)} % of the pool was used` +
        (memory.archive_bytes ? `, ${bytes(memory.archive_bytes)} went to the archive on disk` : ', nothing went to disk') +
        `. The whole program, with the scan being read, peaked at ${bytes(memory.process_peak_bytes)}.`),
  )
}

export function addResources(report: Report, scans: Scans) {
  timePart(report, scans, byId('time-part'))
  memoryPart(report, byId('memory-part'))
  if (!byId('time-part').firstChild && !byId('memory-part').firstChild) byId('resources').hidden = true
}
