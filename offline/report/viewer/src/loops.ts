// The list of loops, and what there is to say and to see of the one that is chosen.
import type { CloudNode } from './cloud'
import type { Loop, Report } from './data'
import { byId, digits, make, metres } from './dom'
import { OverlapView, visitsOf } from './overlap'
import type { Scans } from './scans'

type Filter = 'all' | 'closed' | 'refused'

export class LoopsSection {
  onSelect: (index: number) => void = () => {}
  private readonly list = byId('loop-list')
  private readonly rows: HTMLElement[] = []
  private readonly overlap = new OverlapView({
    before: byId<HTMLCanvasElement>('overlap-before'),
    after: byId<HTMLCanvasElement>('overlap-after'),
  })
  private selected = -1

  constructor(
    private readonly report: Report,
    private readonly scans: Scans,
    private readonly nodes: () => readonly CloudNode[],
  ) {
    const { loops } = report.run
    const closed = loops.filter((loop) => loop.accepted).length
    byId('loops-summary').textContent =
      loops.length === 0
        ? 'No place was visited twice, as far as the mapper saw: no loop was offered.'
        : `${closed} closed, ${loops.length - closed} refused. Choose one here or by its arc in the map.`
    if (loops.length === 0) byId('loops-body').hidden = true
    loops.forEach((loop, index) => {
      const row = make(
        'div',
        { role: 'option', id: `loop-${index}`, 'aria-selected': 'false', class: loop.accepted ? 'closed' : 'refused' },
        make('span', { class: 'mark', 'aria-hidden': 'true' }, loop.accepted ? '●' : '✕'),
        make('span', { class: 'name' }, `${index + 1}`),
        make('span', {}, `${this.name(loop.first)} – ${this.name(loop.last)}`),
        make('span', { class: 'number' }, loop.distance_m === undefined ? '' : metres(loop.distance_m)),
        make('span', { class: 'verdict' }, this.verdict(loop)),
      )
      row.addEventListener('click', () => this.onSelect(index))
      this.rows.push(row)
      this.list.append(row)
    })
    this.list.addEventListener('keydown', (event) => this.onKey(event))
    for (const button of document.querySelectorAll<HTMLButtonElement>('#loop-filter button'))
      button.addEventListener('click', () => this.filter(button.dataset.value as Filter))
    for (const button of document.querySelectorAll<HTMLButtonElement>('#overlap-slice button'))
      button.addEventListener('click', () => {
        press('#overlap-slice button', button)
        this.overlap.setWallsOnly(button.dataset.value === 'walls')
      })
  }

  private name(scan: number): string {
    return String(this.scans.number(scan))
  }
  private verdict(loop: Loop): string {
    return (loop.reason ?? (loop.accepted ? 'closed' : 'refused')).replace(/^refused: /, '')
  }

  private filter(filter: Filter) {
    press('#loop-filter button', document.querySelector<HTMLElement>(`#loop-filter [data-value=${filter}]`)!)
    this.report.run.loops.forEach((loop, i) => {
      this.rows[i].hidden = filter !== 'all' && loop.accepted !== (filter === 'closed')
    })
  }

  private onKey(event: KeyboardEvent) {
    const shown = this.rows.map((_, i) => i).filter((i) => !this.rows[i].hidden)
    if (shown.length === 0) return
    const at = shown.indexOf(this.selected)
    const to: Record<string, number> = {
      ArrowDown: Math.min(at + 1, shown.length - 1),
      ArrowUp: Math.max(at - 1, 0),
      n: Math.min(at + 1, shown.length - 1),
      p: Math.max(at - 1, 0),
      Home: 0,
      End: shown.length - 1,
    }
    const place = to[event.key]
    if (place === undefined) return
    event.preventDefault()
    this.onSelect(shown[place])
  }

  select(index: number) {
    this.rows[this.selected]?.setAttribute('aria-selected', 'false')
    this.selected = index
    const row = this.rows[index]
    row.hidden = false
    row.setAttribute('aria-selected', 'true')
    this.list.setAttribute('aria-activedescendant', row.id)
    const { top, bottom } = row.getBoundingClientRect()
    const box = this.list.getBoundingClientRect()
    if (top < box.top) this.list.scrollTop -= box.top - top
    if (bottom > box.bottom) this.list.scrollTop += bottom - box.bottom
    this.describe(this.report.run.loops[index], index)
    this.refresh()
  }

  /** Once more points have come. */
  refresh() {
    const loop = this.report.run.loops[this.selected]
    if (!loop) return
    const visits = visitsOf(this.report, this.scans, this.nodes(), loop)
    this.overlap.show(visits, loop.correction_m ?? 1)
    byId('before-caption').textContent =
      visits.source === 'offered'
        ? 'Before: as the poses had it when the loop was offered'
        : visits.source === 'without_loops'
          ? 'Before: as if no loop at all had been closed'
          : 'Before: not known of this map'
    byId('after-caption').textContent = loop.accepted
      ? 'After: in the finished map'
      : 'In the finished map, which this loop was not allowed to bend'
  }
  redraw() {
    this.overlap.drawNow()
  }

  private describe(loop: Loop, index: number) {
    const title = `Loop ${index + 1}: scan ${this.name(loop.last)} comes back to scan ${this.name(loop.first)}`
    byId('loop-title').textContent = title
    const moved =
      loop.correction_m === undefined
        ? ''
        : ` The match ${loop.accepted ? 'moved' : 'would have moved'} it by ${metres(loop.correction_m)}` +
          (loop.correction_deg === undefined ? '.' : ` and ${digits(loop.correction_deg, 2)}°.`)
    const why = loop.accepted ? 'Closed.' : `Refused: ${this.verdict(loop)}.`
    byId('loop-text').textContent = why + moved
    byId('loop-text').className = loop.accepted ? 'closed' : 'refused'
    const bounds = this.report.run.settings?.loop_verification ?? this.report.run.settings?.belief ?? {}
    byId('loop-measures').replaceChildren(
      measure('Overlap', loop.overlap, bounds.minimum_overlap, 1, 'at least', (v) => `${Math.round(100 * v)} %`),
      measure('Residual (rms)', loop.rms_m, bounds.maximum_rms_m, 2 * (bounds.maximum_rms_m ?? 0.1), 'at most', metres),
      measure(
        'Correction over its uncertainty, squared',
        loop.accepted || (loop.mahalanobis2 ?? 0) > 0 ? loop.mahalanobis2 : undefined,
        bounds.maximum_mahalanobis2,
        2 * (bounds.maximum_mahalanobis2 ?? 30),
        'at most',
        (v) => digits(v, 2),
      ),
    )
    byId('announcer').textContent = `${title}. ${why}${moved}`
  }
}

/** A bar with the limit on it. */
function measure(
  name: string,
  value: number | undefined,
  limit: number | undefined,
  full: number,
  sense: 'at least' | 'at most',
  format: (value: number) => string,
): HTMLElement {
  if (value === undefined)
    return make('div', { class: 'measure' }, make('span', {}, name), make('span', { class: 'number' }, 'not reached'))
  const good = limit === undefined || (sense === 'at least' ? value >= limit : value <= limit)
  const share = (v: number) => `${Math.min(100, (100 * v) / full)}%`
  const bar = make('div', { class: 'bar' }, make('i', { style: `width:${share(value)}`, class: good ? 'good' : 'bad' }))
  if (limit !== undefined) bar.append(make('b', { style: `left:${share(limit)}` }))
  return make(
    'div',
    { class: 'measure' },
    make('span', {}, name),
    make('span', { class: 'number' }, format(value)),
    bar,
    make('small', {}, limit === undefined ? '' : `${sense} ${format(limit)}`),
  )
}

/** One button of a group is down. */
export function press(group: string, button: HTMLElement) {
  for (const other of document.querySelectorAll(group)) other.setAttribute('aria-pressed', String(other === button))
}
