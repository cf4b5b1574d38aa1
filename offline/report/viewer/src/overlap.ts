// The two visits of a loop's place over each other, before and after it was closed.
//
// The first visit are the scans around `first`, the second those up to `last`, as the mapper matched them. Seen from above, in
// the frame of `first`. "Before" is how the two stood when the loop was offered; each visit in itself is as it is now.
import { Quaternion, Vector3 } from 'three'
import type { CloudNode } from './cloud'
import { scanOf } from './cloud'
import { themeColor } from './colors'
import type { Loop, Report } from './data'
import { digits, onceAFrame, roundStep } from './dom'
import { compose, inverse, Pose, Scans } from './scans'

const radius = 25 // m about the place
const mostPoints = 60000 // a visit

export interface Visits {
  first: Float32Array // x, y, z in the frame of scan `first`, point by point
  lastAfter: Float32Array
  lastBefore: Float32Array
  ground: number
  /** How `before` is known: the mapper's own record, or from the trajectory without any loop. */
  source: 'offered' | 'without_loops' | 'none'
}

/** The scans that the mapper put together, as far as run.json's settings say. */
function scansAround(report: Report, loop: Loop): { first: [number, number]; last: [number, number] } {
  const settings = report.run.settings?.loop_match ?? {}
  const around = Number(settings.scans_around_first ?? 2)
  const before = Number(settings.scans_before_last ?? 2)
  return {
    first: [Math.max(0, loop.first - around), Math.min(loop.first + around, loop.last - 1)],
    last: [Math.max(loop.last - before, loop.first + 1), loop.last],
  }
}

function collect(
  report: Report,
  nodes: readonly CloudNode[],
  [begin, end]: [number, number],
  place: Vector3,
): number[] {
  const points: number[] = []
  for (const node of nodes) {
    const [ox, oy, oz] = node.origin
    if (
      place.x < ox - radius || place.x > ox + node.side + radius ||
      place.y < oy - radius || place.y > oy + node.side + radius ||
      place.z < oz - radius || place.z > oz + node.side + radius
    )
      continue
    const { points: packed, step } = node
    for (let i = 0; i < packed.length; i += 4) {
      const scan = scanOf(report.cloud, packed[i + 3])
      if (scan < begin || scan > end) continue
      const x = ox + packed[i] * step
      const y = oy + packed[i + 1] * step
      if (Math.abs(x - place.x) > radius || Math.abs(y - place.y) > radius) continue
      points.push(x, y, oz + packed[i + 2] * step)
    }
  }
  if (points.length <= 3 * mostPoints) return points
  const every = Math.ceil(points.length / 3 / mostPoints)
  return points.filter((_, i) => Math.floor(i / 3) % every === 0)
}

function transformed(points: number[], move: Pose): Float32Array {
  const result = new Float32Array(points.length)
  const at = new Vector3()
  for (let i = 0; i < points.length; i += 3) {
    at.set(points[i], points[i + 1], points[i + 2]).applyQuaternion(move.rotation).add(move.position)
    result[i] = at.x
    result[i + 1] = at.y
    result[i + 2] = at.z
  }
  return result
}

export function visitsOf(report: Report, scans: Scans, nodes: readonly CloudNode[], loop: Loop): Visits {
  const around = scansAround(report, loop)
  const place = scans.pose(loop.first).position
  const firstFromMap = inverse(scans.pose(loop.first))
  const lastFromMap = inverse(scans.pose(loop.last))
  let source: Visits['source'] = 'none'
  let firstFromLast = compose(firstFromMap, scans.pose(loop.last))
  if (loop.first_from_last_before) {
    const [x, y, z, qx, qy, qz, qw] = loop.first_from_last_before
    firstFromLast = { position: new Vector3(x, y, z), rotation: new Quaternion(qx, qy, qz, qw).normalize() }
    source = 'offered'
  } else if (scans.hasBefore) {
    firstFromLast = compose(inverse(scans.poseBefore(loop.first)), scans.poseBefore(loop.last))
    source = 'without_loops'
  }
  const firstPoints = collect(report, nodes, around.first, place)
  const lastPoints = collect(report, nodes, around.last, place)
  const first = transformed(firstPoints, firstFromMap)
  const heights = Array.from({ length: first.length / 3 }, (_, i) => first[3 * i + 2]).sort((a, b) => a - b)
  return {
    first,
    lastAfter: transformed(lastPoints, firstFromMap),
    lastBefore: transformed(lastPoints, compose(firstFromLast, lastFromMap)),
    ground: heights[Math.floor(0.05 * heights.length)] ?? 0,
    source,
  }
}

/** Two pictures of the same place that move together. */
export class OverlapView {
  private visits: Visits | null = null
  private view = { x: 0, y: 0, metres: 30 } // middle, and how much is seen across
  private wallsOnly = true

  constructor(private readonly canvases: { before: HTMLCanvasElement; after: HTMLCanvasElement }) {
    for (const canvas of [canvases.before, canvases.after]) {
      this.listen(canvas)
      new ResizeObserver(() => this.draw()).observe(canvas)
    }
  }

  /** `correction` is how far the two are apart before, in m: it is to be seen. */
  show(visits: Visits | null, correction: number) {
    this.visits = visits
    this.view = { x: 0, y: 0, metres: Math.min(36, Math.max(12, 25 * correction)) }
    this.draw()
  }
  setWallsOnly(wallsOnly: boolean) {
    this.wallsOnly = wallsOnly
    this.draw()
  }
  readonly draw = onceAFrame(() => this.drawNow())
  /** At once: printing does not wait for a frame. */
  drawNow() {
    this.paint(this.canvases.before, this.visits?.lastBefore)
    this.paint(this.canvases.after, this.visits?.lastAfter)
  }

  private listen(canvas: HTMLCanvasElement) {
    const zoom = (factor: number) => {
      this.view.metres = Math.min(2 * radius, Math.max(1, this.view.metres * factor))
      this.draw()
    }
    const move = (right: number, up: number) => {
      this.view.x += up * this.view.metres
      this.view.y -= right * this.view.metres
      this.draw()
    }
    canvas.addEventListener(
      'wheel',
      (event) => {
        if (document.activeElement !== canvas) return
        event.preventDefault()
        zoom(Math.exp(0.0015 * event.deltaY))
      },
      { passive: false },
    )
    canvas.addEventListener('pointerdown', (event) => canvas.setPointerCapture(event.pointerId))
    canvas.addEventListener('pointermove', (event) => {
      if (event.buttons === 1) move(-event.movementX / canvas.clientWidth, event.movementY / canvas.clientWidth)
    })
    canvas.addEventListener('keydown', (event) => {
      const keys: Record<string, () => void> = {
        '+': () => zoom(0.8),
        '=': () => zoom(0.8),
        '-': () => zoom(1.25),
        ArrowLeft: () => move(-0.1, 0),
        ArrowRight: () => move(0.1, 0),
        ArrowUp: () => move(0, 0.1),
        ArrowDown: () => move(0, -0.1),
      }
      if (!keys[event.key]) return
      event.preventDefault()
      keys[event.key]()
    })
  }

  private paint(canvas: HTMLCanvasElement, last: Float32Array | undefined) {
    const ratio = Math.min(2, devicePixelRatio || 1)
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio))
    const height = Math.max(1, Math.round(canvas.clientHeight * ratio))
    if (canvas.width !== width) canvas.width = width
    if (canvas.height !== height) canvas.height = height
    const ink = canvas.getContext('2d')!
    ink.globalCompositeOperation = 'source-over'
    ink.fillStyle = themeColor('panel')
    ink.fillRect(0, 0, width, height)
    if (!this.visits || !last) return
    const scale = width / this.view.metres
    const isDark = themeColor('scheme') === 'dark'
    ink.globalCompositeOperation = isDark ? 'lighten' : 'darken'
    const size = Math.max(1.5 * ratio, 0.03 * scale)
    const { ground } = this.visits
    // Heights are those of the finished map on both sides: where the drive had drifted up, "before" shows the same walls.
    for (const [points, finished, color] of [
      [this.visits.first, this.visits.first, themeColor('visit-first')],
      [last, this.visits.lastAfter, themeColor('visit-last')],
    ] as const) {
      ink.fillStyle = color
      for (let i = 0; i < points.length; i += 3) {
        if (this.wallsOnly && (finished[i + 2] < ground + 0.5 || finished[i + 2] > ground + 2.5)) continue
        // x forward is up, y left is left
        const px = width / 2 - (points[i + 1] - this.view.y) * scale
        const py = height / 2 - (points[i] - this.view.x) * scale
        if (px < 0 || py < 0 || px > width || py > height) continue
        ink.fillRect(px - size / 2, py - size / 2, size, size)
      }
    }
    ink.globalCompositeOperation = 'source-over'
    const length = roundStep(0.3 * this.view.metres)
    ink.strokeStyle = ink.fillStyle = themeColor('ink')
    ink.lineWidth = 1.5 * ratio
    const x = 10 * ratio
    const y = height - 10 * ratio
    ink.beginPath()
    ink.moveTo(x, y - 4 * ratio)
    ink.lineTo(x, y)
    ink.lineTo(x + length * scale, y)
    ink.lineTo(x + length * scale, y - 4 * ratio)
    ink.stroke()
    ink.font = `${12 * ratio}px system-ui, sans-serif`
    ink.fillText(`${digits(length, 1)} m`, x + 6 * ratio, y - 6 * ratio)
  }
}
