// Small helpers: elements, and numbers as people read them.

export function byId<T extends HTMLElement>(id: string): T {
  return document.getElementById(id) as T
}

type Child = Node | string
export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Record<string, string> = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag)
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value)
  element.append(...children)
  return element
}

export function makeSvg(tag: string, attributes: Record<string, string | number> = {}, ...children: Child[]) {
  const element = document.createElementNS('http://www.w3.org/2000/svg', tag)
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value))
  element.append(...children)
  return element
}

export function table(columns: string[], rows: Child[][], numeric: number[] = []): HTMLTableElement {
  const cell = (tag: 'th' | 'td', content: Child, i: number) =>
    make(tag, numeric.includes(i) ? { class: 'number' } : {}, content)
  return make(
    'table',
    {},
    make('thead', {}, make('tr', {}, ...columns.map((name, i) => cell('th', name, i)))),
    make('tbody', {}, ...rows.map((row) => make('tr', {}, ...row.map((value, i) => cell('td', value, i))))),
  )
}

/** Thin spaces between thousands: 9 868 002. */
export function whole(value: number): string {
  return Math.round(value)
    .toString()
    .replace(/\B(?=(\d{3})+$)/g, '\u202f')
}
/** About three digits. */
export function digits(value: number, count = 3): string {
  if (value === 0 || !Number.isFinite(value)) return String(value)
  const decimals = Math.max(0, count - 1 - Math.floor(Math.log10(Math.abs(value))))
  return value.toFixed(Math.min(decimals, 6))
}
export function millions(value: number): string {
  return value >= 1e6 ? `${digits(value / 1e6)} million` : whole(value)
}
export function metres(value: number): string {
  if (Math.abs(value) < 0.995) return `${digits(value * 100, value < 0.01 ? 1 : 2)} cm`
  return `${digits(value)} m`
}
export function bytes(value: number): string {
  if (value >= 2 ** 30) return `${digits(value / 2 ** 30)} GiB`
  if (value >= 2 ** 20) return `${digits(value / 2 ** 20)} MiB`
  if (value >= 2 ** 10) return `${digits(value / 2 ** 10)} KiB`
  return `${value} B`
}
export function duration(seconds: number): string {
  if (seconds < 0.1) return `${digits(seconds * 1e3)} ms`
  if (seconds < 120) return `${digits(seconds)} s`
  if (seconds < 7200) return `${Math.floor(seconds / 60)} min ${Math.round(seconds % 60)} s`
  return `${Math.floor(seconds / 3600)} h ${Math.round((seconds % 3600) / 60)} min`
}
/** 1, 2 or 5 times a power of ten, at most `value`. */
export function roundStep(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value))
  for (const step of [5, 2]) if (step * power <= value) return step * power
  return power
}

/** Fewer calls: at most one a frame, the last arguments win. */
export function onceAFrame<A extends unknown[]>(call: (...args: A) => void): (...args: A) => void {
  let latest: A | undefined
  return (...args) => {
    const waiting = latest !== undefined
    latest = args
    if (waiting) return
    requestAnimationFrame(() => {
      const now = latest!
      latest = undefined
      call(...now)
    })
  }
}
