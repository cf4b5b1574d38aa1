// The map to turn and zoom: chooses which nodes are worth drawing, keeps every frame short, and draws the drive and the
// loops over the points.
//
// While something moves a frame draws at most a budget of points, the coarsest and nearest nodes first; the budget follows
// the time that frames take. When all stands still, the frames after it add the nodes left out, a budget's worth each, to
// what is there: detail comes, and no frame is ever longer than one in motion.
import { Frustum, Matrix4, PerspectiveCamera, Sphere, Vector3 } from 'three'
import { OrbitControls } from 'three/addons/controls/OrbitControls.js'
import { CloudNode, loadCloud } from './cloud'
import { ColorMode, rampCss } from './colors'
import type { Loop, Report } from './data'
import { digits, make, metres, onceAFrame, roundStep, whole } from './dom'
import type { Coloring, Painter } from './painter'
import { CanvasPainter } from './points_canvas'
import { WebGlPainter } from './points_webgl'
import { compose, inverse, Scans } from './scans'

const frameGoalMs = 22
const mostPathPoints = 4000

interface Arc {
  index: number
  loop: Loop
  path: [number, number][] // on the screen, as drawn last
}

/** rotation, translation (of scene coordinates) and correction of the map before, for every scan's number in the cloud. */
function movesOf(report: Report, scans: Scans, center: Vector3): Float32Array {
  const each = report.cloud.scans_a_number
  const moves = new Float32Array(8 * Math.ceil(scans.count / each))
  for (let i = 0; 8 * i < moves.length; ++i) {
    const scan = Math.min(i * each, scans.count - 1)
    const move = compose(scans.poseBefore(scan), inverse(scans.pose(scan)))
    let { rotation } = move
    if (rotation.w < 0) rotation = rotation.set(-rotation.x, -rotation.y, -rotation.z, -rotation.w)
    const shift = center.clone().applyQuaternion(rotation).add(move.position).sub(center)
    moves.set([rotation.x, rotation.y, rotation.z, rotation.w, shift.x, shift.y, shift.z, scans.correction[scan]], 8 * i)
  }
  return moves
}

export class Viewer {
  readonly painter: Painter
  /** How long the latest frames took, in ms: for measuring. */
  readonly frameTimes: { ms: number; points: number; moving: boolean }[] = []
  onLoop: (index: number) => void = () => {}
  /** The colour scale's range is known. */
  onLegend: () => void = () => {}

  private readonly camera = new PerspectiveCamera(45, 1, 0.1, 5000)
  private readonly controls: OrbitControls
  private readonly overlay = document.createElement('canvas')
  private readonly ink: CanvasRenderingContext2D
  private readonly nodes: CloudNode[] = []
  private readonly center: Vector3
  private readonly radius: number
  private readonly after: Vector3[]
  private readonly before: Vector3[]
  private readonly arcs: Arc[]
  private readonly heights: [number, number]
  private mode: ColorMode = 'height'
  private undo = 0
  private pointScale = 1
  private selected: number | null = null
  private hovered: number | null = null
  private scan: number | null = null
  private waiting: CloudNode[] = []
  private budget: number
  private scheduled = false
  private movedAt = 0
  private flight: { from: Vector3; to: Vector3; fromTarget: Vector3; toTarget: Vector3; begin: number } | null = null
  private readonly show = { after: true, before: false, loops: true }

  constructor(
    private readonly host: HTMLElement,
    private readonly report: Report,
    private readonly scans: Scans,
    wish: string | null, // webgl or canvas, else what is best
  ) {
    const { cloud } = report
    const poses = Array.from({ length: scans.count }, (_, i) => scans.pose(i).position)
    const low = new Vector3(...cloud.origin_m)
    // The middle of the drive, not of the cloud: a few far points must not move the map out of the picture.
    const driven = new Vector3()
    for (const position of poses) driven.addScaledVector(position, 1 / poses.length)
    this.center = driven
    const spread = poses.map((position) => position.distanceTo(driven)).sort((a, b) => a - b)
    this.radius = Math.max(15, 1.1 * (spread[Math.floor(0.98 * (spread.length - 1))] ?? 0) + 10)
    this.heights = [low.z, low.z + cloud.side_m]
    this.after = poses.map((position) => position.clone().sub(this.center))
    this.before = poses.map((_, i) => scans.poseBefore(i).position.sub(this.center))
    this.arcs = report.run.loops.map((loop, index) => ({ index, loop, path: [] }))

    const moves = movesOf(report, scans, this.center)
    this.painter = this.choosePainter(wish, moves)
    this.budget = this.painter.firstPointsAFrame
    this.painter.canvas.className = 'points'
    this.painter.canvas.setAttribute('aria-hidden', 'true')
    this.overlay.className = 'overlay'
    // Lines, too, are drawn by the processor itself where it would only pretend to be a graphics processor.
    this.ink = this.overlay.getContext('2d', { willReadFrequently: this.painter.kind === 'canvas' })!
    this.host.prepend(this.painter.canvas, this.overlay)

    this.camera.up.set(0, 0, 1)
    this.controls = new OrbitControls(this.camera, this.overlay)
    this.controls.enableDamping = false
    this.controls.zoomToCursor = true
    this.controls.maxPolarAngle = Math.PI * 0.95
    this.controls.minDistance = 0.5
    this.controls.maxDistance = 12 * this.radius
    this.controls.enableZoom = false // until it has the focus, the wheel scrolls the page
    this.controls.addEventListener('change', () => this.moved())
    this.host.addEventListener('focus', () => (this.controls.enableZoom = true))
    this.host.addEventListener('blur', () => (this.controls.enableZoom = false))
    this.host.addEventListener('keydown', (event) => this.onKey(event))
    this.listenToPointer()
    new ResizeObserver(() => this.resize()).observe(this.host)
    this.resize()
    this.home(false)
  }

  private choosePainter(wish: string | null, moves: Float32Array): Painter {
    if (wish !== 'canvas') {
      try {
        return new WebGlPainter(this.center, moves, wish === 'webgl')
      } catch {
        // as it says below the map
      }
    }
    return new CanvasPainter(this.center, moves)
  }

  async load(progress: (share: number) => void): Promise<void> {
    await loadCloud(this.report.cloud, (nodes, share) => {
      for (const node of nodes) {
        this.nodes.push(node)
        this.painter.addNode(node)
      }
      if (this.nodes[0].level === 0 && nodes[0].id === 0) this.measureHeights(this.nodes[0])
      this.moved()
      progress(share)
    })
  }

  /** Of the coarsest points, which are spread evenly over the map. */
  private measureHeights(node: CloudNode) {
    const heights: number[] = []
    for (let i = 2; i < node.points.length; i += 4) heights.push(node.origin[2] + node.points[i] * node.step)
    heights.sort((a, b) => a - b)
    const at = (share: number) => heights[Math.floor(share * (heights.length - 1))]
    this.heights[0] = at(0.02)
    this.heights[1] = Math.max(at(0.98), at(0.02) + 0.5)
    this.onLegend()
  }

  /** All that is to be seen is drawn. */
  get isSettled(): boolean {
    return !this.scheduled && this.flight === null && this.waiting.length === 0
  }
  get points(): number {
    return this.nodes.reduce((sum, node) => sum + node.count, 0)
  }
  allNodes(): readonly CloudNode[] {
    return this.nodes
  }

  setMode(mode: ColorMode) {
    this.mode = mode
    this.moved()
  }
  setUndo(undo: number) {
    this.undo = undo
    this.moved()
  }
  setPointScale(scale: number) {
    this.pointScale = scale
    this.moved()
  }
  setShown(what: 'after' | 'before' | 'loops', shown: boolean) {
    this.show[what] = shown
    this.drawOverlay()
  }

  /** The colour scale in words, and as CSS. */
  legend(): { title: string; low: string; high: string; gradient: string } {
    const gradient = rampCss(this.mode)
    const stamps = this.scans.column('stamp')!
    if (this.mode === 'height')
      return { title: 'height', low: `${this.heights[0].toFixed(1)} m`, high: `${this.heights[1].toFixed(1)} m`, gradient }
    if (this.mode === 'correction')
      return { title: 'moved by closing loops', low: '0', high: metres(this.scans.largestCorrection), gradient }
    if (this.mode === 'intensity') return { title: 'intensity', low: '0', high: whole(this.brightest()), gradient }
    const last = this.scans.count - 1
    return this.report.has_time
      ? { title: 'time', low: 'start', high: `${whole(stamps[last])} s`, gradient }
      : { title: 'scan', low: String(this.scans.number(0)), high: String(this.scans.number(last)), gradient }
  }

  /** The intensity that 98 of 100 points do not exceed: reflectors are few and far brighter. */
  private brightest(): number {
    const counts = new Array<number>(256).fill(0)
    for (const node of this.nodes) node.intensity?.forEach((value) => ++counts[value])
    let left = 0.02 * this.points
    let value = 255
    while (value > 1 && (left -= counts[value]) >= 0) --value
    return value
  }

  private coloring(): Coloring {
    const each = this.report.cloud.scans_a_number
    const [low, high] =
      this.mode === 'height'
        ? this.heights
        : this.mode === 'time'
          ? [0, Math.max(1, (this.scans.count - 1) / each)]
          : this.mode === 'intensity'
            ? [0, this.brightest()]
            : [0, Math.max(1e-3, this.scans.largestCorrection)]
    const at = this.scan === null ? undefined : Math.floor(this.scan / each)
    return {
      mode: this.mode,
      low,
      high,
      undo: this.undo,
      pointScale: this.pointScale,
      highlight: at === undefined ? undefined : [at, at],
    }
  }

  // ------------------------------------------------------------------------------------------------ the camera

  home(animated = true) {
    // As near as shows all of the drive, and something of what is about it.
    const back = new Vector3(-0.35, -0.5, 0.79).normalize()
    const right = new Vector3(0, 0, 1).cross(back).normalize()
    const up = back.clone().cross(right)
    const tall = Math.tan((this.camera.fov * Math.PI) / 360)
    const wide = tall * this.camera.aspect
    let distance = 0
    for (const place of this.after) {
      const across = Math.max((Math.abs(place.dot(right)) + 15) / wide, (Math.abs(place.dot(up)) + 15) / tall)
      distance = Math.max(distance, across + place.dot(back))
    }
    this.fly(back.multiplyScalar(1.05 * distance), new Vector3(0, 0, 0), animated)
  }

  private fly(to: Vector3, toTarget: Vector3, animated: boolean) {
    const calm = !animated || matchMedia('(prefers-reduced-motion: reduce)').matches
    if (calm) {
      this.camera.position.copy(to)
      this.controls.target.copy(toTarget)
      this.controls.update()
      this.moved()
      return
    }
    const begin = performance.now()
    this.flight = { from: this.camera.position.clone(), to, fromTarget: this.controls.target.clone(), toTarget, begin }
    this.moved()
  }

  private advanceFlight() {
    const flight = this.flight
    if (!flight) return
    const share = Math.min(1, (performance.now() - flight.begin) / 600)
    const eased = share * share * (3 - 2 * share)
    this.camera.position.lerpVectors(flight.from, flight.to, eased)
    this.controls.target.lerpVectors(flight.fromTarget, flight.toTarget, eased)
    if (share === 1) this.flight = null
    this.controls.update()
    this.movedAt = performance.now()
  }

  selectLoop(index: number | null, goThere: boolean) {
    this.selected = index
    if (index !== null && goThere) {
      const { first, last } = this.report.run.loops[index]
      const target = this.place(first).add(this.place(last)).multiplyScalar(0.5)
      const apart = this.place(first).distanceTo(this.place(last))
      const back = this.camera.position.clone().sub(this.controls.target).normalize()
      back.z = Math.max(back.z, 0.55)
      this.fly(target.clone().addScaledVector(back.normalize(), Math.max(45, 2.5 * apart)), target, true)
    }
    this.drawOverlay()
  }

  highlightScan(scan: number | null) {
    if (scan === this.scan) return
    this.scan = scan
    this.drawOverlay()
  }

  private readonly orbit = (azimuth: number, polar: number) => {
    const offset = this.camera.position.clone().sub(this.controls.target)
    const distance = offset.length()
    const theta = Math.atan2(offset.y, offset.x) + azimuth
    const phi = Math.min(3, Math.max(0.02, Math.acos(offset.z / distance) + polar))
    offset.set(Math.sin(phi) * Math.cos(theta), Math.sin(phi) * Math.sin(theta), Math.cos(phi)).multiplyScalar(distance)
    this.camera.position.copy(this.controls.target).add(offset)
    this.controls.update()
    this.moved()
  }
  private pan(right: number, up: number) {
    const step = 0.08 * this.camera.position.distanceTo(this.controls.target)
    const sideways = new Vector3().setFromMatrixColumn(this.camera.matrix, 0).setZ(0).normalize()
    const forward = new Vector3(-sideways.y, sideways.x, 0)
    const move = sideways.multiplyScalar(right * step).addScaledVector(forward, up * step)
    this.camera.position.add(move)
    this.controls.target.add(move)
    this.controls.update()
    this.moved()
  }
  zoom(factor: number) {
    const offset = this.camera.position.clone().sub(this.controls.target).multiplyScalar(factor)
    offset.clampLength(this.controls.minDistance, this.controls.maxDistance)
    this.camera.position.copy(this.controls.target).add(offset)
    this.controls.update()
    this.moved()
  }

  private onKey(event: KeyboardEvent) {
    if (event.ctrlKey || event.metaKey || event.altKey) return
    const turn = 0.08
    const shift = event.shiftKey
    const keys: Record<string, () => void> = {
      ArrowLeft: () => (shift ? this.pan(-1, 0) : this.orbit(-turn, 0)),
      ArrowRight: () => (shift ? this.pan(1, 0) : this.orbit(turn, 0)),
      ArrowUp: () => (shift ? this.pan(0, 1) : this.orbit(0, -turn)),
      ArrowDown: () => (shift ? this.pan(0, -1) : this.orbit(0, turn)),
      '+': () => this.zoom(0.85),
      '=': () => this.zoom(0.85),
      '-': () => this.zoom(1 / 0.85),
      Home: () => this.home(),
      n: () => this.step(1),
      p: () => this.step(-1),
    }
    const action = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key]
    if (!action) return
    event.preventDefault()
    action()
  }

  private step(by: number) {
    const count = this.arcs.length
    if (count === 0) return
    const from = this.selected ?? (by > 0 ? -1 : count)
    this.onLoop((from + by + count) % count)
  }

  // ------------------------------------------------------------------------------------------------ frames

  private resize() {
    const width = this.host.clientWidth
    const height = this.host.clientHeight
    if (width === 0 || height === 0) return
    const ratio = Math.min(2, devicePixelRatio || 1)
    this.painter.resize(width, height, ratio)
    this.overlay.width = Math.round(width * ratio)
    this.overlay.height = Math.round(height * ratio)
    this.camera.aspect = width / height
    this.camera.updateProjectionMatrix()
    this.moved()
  }

  private moved() {
    this.movedAt = performance.now()
    this.waiting = []
    this.schedule()
  }
  private schedule() {
    if (this.scheduled) return
    this.scheduled = true
    requestAnimationFrame(() => {
      this.scheduled = false
      this.frame()
    })
  }

  private lastFrameAt = 0
  private frame() {
    const begin = performance.now()
    this.advanceFlight()
    const restarts = this.waiting.length === 0
    if (restarts) {
      this.placeClippingPlanes()
      this.waiting = this.choose()
    }
    const slice: CloudNode[] = []
    let points = 0
    while (this.waiting.length > 0 && (points === 0 || points + this.waiting[0].count <= this.budget)) {
      points += this.waiting[0].count
      slice.push(this.waiting.shift()!)
    }
    this.painter.draw(this.camera, slice, this.coloring(), restarts)
    if (restarts) this.drawOverlay()
    const now = performance.now()
    const moving = now - this.movedAt < 200
    // The graphics processor works on after the call returns: what counts is when the next frame comes. A plain canvas is
    // done then, and what else the browser does between two frames is not the points' doing.
    const since = begin - this.lastFrameAt
    const ms = this.painter.kind === 'webgl' && since < 500 ? Math.max(since, now - begin) : now - begin
    this.lastFrameAt = begin
    this.frameTimes.push({ ms, points, moving })
    if (this.frameTimes.length > 600) this.frameTimes.splice(0, 300)
    const factor = ms > 1.5 * frameGoalMs ? 0.75 : ms < 0.85 * frameGoalMs && points > 0.8 * this.budget ? 1.15 : 1
    this.budget = Math.min(
      this.painter.mostPointsAFrame,
      Math.max(this.painter.leastPointsAFrame, this.budget * factor),
    )
    if (this.flight) {
      this.waiting = []
      this.schedule()
    } else if (this.waiting.length > 0) {
      this.schedule()
    }
  }

  private placeClippingPlanes() {
    const distance = this.camera.position.distanceTo(this.controls.target)
    this.camera.near = Math.max(0.05, distance / 400)
    this.camera.far = 4 * distance + 8 * this.radius
    this.camera.updateProjectionMatrix()
    this.camera.updateMatrixWorld()
  }

  /** Nodes that are seen and fine enough to tell, coarse and near ones first. */
  private choose(): CloudNode[] {
    const matrix = new Matrix4().multiplyMatrices(this.camera.projectionMatrix, this.camera.matrixWorldInverse)
    const frustum = new Frustum().setFromProjectionMatrix(matrix)
    const pixels = this.painter.canvas.height / (2 * Math.tan((this.camera.fov * Math.PI) / 360))
    const slack = this.undo * this.scans.largestCorrection
    const sphere = new Sphere()
    const chosen: { node: CloudNode; size: number }[] = []
    for (const node of this.nodes) {
      sphere.center.set(...node.origin).addScalar(node.side / 2).sub(this.center)
      sphere.radius = (node.side * Math.sqrt(3)) / 2 + slack
      if (!frustum.intersectsSphere(sphere)) continue
      const distance = Math.max(0.3 * node.side, sphere.center.distanceTo(this.camera.position) - node.side / 2)
      const size = (node.spacing * pixels) / distance // between its points, in pixels
      if (size > 0.3 || node.level === 0) chosen.push({ node, size })
    }
    chosen.sort((a, b) => b.size - a.size || a.node.id - b.node.id)
    return chosen.map(({ node }) => node)
  }

  // ------------------------------------------------------------------------------------------------ the lines

  private place(scan: number): Vector3 {
    return this.after[scan].clone().lerp(this.before[scan], this.undo)
  }

  private project(at: Vector3): [number, number] | null {
    const seen = at.clone().applyMatrix4(this.camera.matrixWorldInverse)
    if (seen.z > -this.camera.near) return null
    seen.applyMatrix4(this.camera.projectionMatrix)
    return [((seen.x + 1) * this.host.clientWidth) / 2, ((1 - seen.y) * this.host.clientHeight) / 2]
  }

  private stroke(path: Iterable<[number, number] | null>, color: string, width: number, dash: number[] = []) {
    const ink = this.ink
    for (const [style, thickness] of [
      ['rgba(5,8,12,0.6)', width + 2.5],
      [color, width],
    ] as const) {
      ink.beginPath()
      let isDown = false
      for (const at of path) {
        if (at) isDown ? ink.lineTo(...at) : ink.moveTo(...at)
        isDown = at !== null
      }
      ink.setLineDash(style === color ? dash : [])
      ink.strokeStyle = style
      ink.lineWidth = thickness
      ink.stroke()
    }
    ink.setLineDash([])
  }

  private readonly drawOverlay = onceAFrame(() => this.drawOverlayNow())

  private drawOverlayNow() {
    const ink = this.ink
    const ratio = this.overlay.width / Math.max(1, this.host.clientWidth)
    ink.setTransform(ratio, 0, 0, ratio, 0, 0)
    ink.clearRect(0, 0, this.host.clientWidth, this.host.clientHeight)
    ink.lineJoin = ink.lineCap = 'round'
    const every = Math.ceil(this.scans.count / mostPathPoints)
    const path = (at: (scan: number) => Vector3) => {
      const places: ([number, number] | null)[] = []
      for (let i = 0; i < this.scans.count; i += every) places.push(this.project(at(i)))
      return places
    }
    if (this.show.before && this.scans.hasBefore) this.stroke(path((i) => this.before[i]), '#ff8fd0', 1.6, [6, 5])
    if (this.show.after) this.stroke(path((i) => this.place(i)), '#ffffff', 1.8)
    if (this.show.after) this.drawEnds()
    for (const arc of this.arcs) arc.path = []
    if (this.show.loops) {
      for (const arc of this.arcs) if (arc.index !== this.selected) this.drawArc(arc)
      if (this.selected !== null) this.drawArc(this.arcs[this.selected])
    }
    if (this.scan !== null) {
      const at = this.project(this.place(this.scan))
      if (at) {
        this.disc(at, 6, '#ffd23f')
        this.label(at, `scan ${this.scans.number(this.scan)}`, '#ffd23f')
      }
    }
    this.drawScale()
  }

  private drawEnds() {
    for (const [scan, color, name] of [
      [0, '#6fd3ff', 'start'],
      [this.scans.count - 1, '#ffb454', 'end'],
    ] as const) {
      const at = this.project(this.place(scan))
      if (!at) continue
      this.disc(at, 4.5, color)
      this.label(at, name, color)
    }
  }

  private disc([x, y]: [number, number], radius: number, color: string) {
    this.ink.beginPath()
    this.ink.arc(x, y, radius, 0, 2 * Math.PI)
    this.ink.fillStyle = color
    this.ink.strokeStyle = 'rgba(5,8,12,0.7)'
    this.ink.lineWidth = 2
    this.ink.fill()
    this.ink.stroke()
  }

  private label([x, y]: [number, number], text: string, color: string) {
    const ink = this.ink
    ink.font = '600 12px system-ui, sans-serif'
    const width = ink.measureText(text).width
    const left = Math.min(x + 10, this.host.clientWidth - width - 6)
    ink.lineWidth = 3.5
    ink.strokeStyle = 'rgba(5,8,12,0.85)'
    ink.strokeText(text, left, y + 4)
    ink.fillStyle = color
    ink.fillText(text, left, y + 4)
  }

  private drawArc(arc: Arc) {
    const from = this.place(arc.loop.first)
    const to = this.place(arc.loop.last)
    const apart = from.distanceTo(to)
    // As high as it is seen well from where the camera is.
    const distance = from.distanceTo(this.camera.position)
    const height = Math.max(0.35 * apart, 0.035 * distance)
    const at = new Vector3()
    for (let i = 0; i <= 16; ++i) {
      const share = i / 16
      at.lerpVectors(from, to, share)
      at.z += 4 * height * share * (1 - share)
      const place = this.project(at)
      if (place) arc.path.push(place)
    }
    if (arc.path.length < 17) return
    const isSelected = arc.index === this.selected
    const isLit = isSelected || arc.index === this.hovered
    const color = isSelected ? '#ffd23f' : arc.loop.accepted ? '#3ddc84' : '#ff5c5c'
    this.stroke(arc.path, color, isLit ? 3 : 1.8, arc.loop.accepted ? [] : [4, 4])
    const top = arc.path[8]
    this.disc(top, isLit ? 5.5 : 3.5, color)
    if (isLit) this.label(top, `loop ${arc.index + 1}`, color)
  }

  private drawScale() {
    const distance = this.camera.position.distanceTo(this.controls.target)
    const pixels = this.host.clientHeight / (2 * Math.tan((this.camera.fov * Math.PI) / 360)) / distance
    const length = roundStep(Math.min(140, 0.3 * this.host.clientWidth) / pixels)
    const x = 14
    const y = this.host.clientHeight - 14
    this.stroke([[x, y - 5], [x, y], [x + length * pixels, y], [x + length * pixels, y - 5]], '#e8edf4', 1.6)
    this.label([x - 6, y - 14], `${digits(length, 1)} m`, '#e8edf4')
  }

  // ------------------------------------------------------------------------------------------------ the pointer

  /** The loop whose arc is near a place of the viewer. */
  pickLoop(x: number, y: number): number | null {
    let best: number | null = null
    let nearest = 11
    for (const arc of this.arcs) {
      for (let i = 0; i + 1 < arc.path.length; ++i) {
        const [ax, ay] = arc.path[i]
        const [bx, by] = arc.path[i + 1]
        const length = Math.hypot(bx - ax, by - ay) || 1
        const along = Math.max(0, Math.min(1, ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length ** 2))
        const distance = Math.hypot(x - ax - along * (bx - ax), y - ay - along * (by - ay))
        if (distance >= nearest) continue
        nearest = distance
        best = arc.index
      }
    }
    return best
  }

  /** Where a loop's arc has its top, in pixels of the viewer. */
  arcTop(index: number): [number, number] | null {
    return this.arcs[index].path[8] ?? null
  }

  private listenToPointer() {
    let down: { x: number; y: number } | null = null
    const at = (event: PointerEvent) => {
      const box = this.overlay.getBoundingClientRect()
      return { x: event.clientX - box.left, y: event.clientY - box.top }
    }
    this.overlay.addEventListener('pointerdown', (event) => {
      this.host.focus({ preventScroll: true })
      down = at(event)
    })
    this.overlay.addEventListener('pointerup', (event) => {
      const up = at(event)
      if (down && Math.hypot(up.x - down.x, up.y - down.y) < 5) {
        const loop = this.pickLoop(up.x, up.y)
        if (loop !== null) this.onLoop(loop)
      }
      down = null
    })
    this.overlay.addEventListener('pointermove', (event) => {
      if (event.buttons !== 0) return
      const { x, y } = at(event)
      const loop = this.pickLoop(x, y)
      if (loop === this.hovered) return
      this.hovered = loop
      this.overlay.style.cursor = loop === null ? '' : 'pointer'
      this.drawOverlay()
    })
  }

  // ------------------------------------------------------------------------------------------------ measuring

  /** A turn of the camera: ms and points of each frame, waited for until it is drawn; `budget` points if given. */
  async measure(frames: number, budget?: number): Promise<{ ms: number[]; points: number[] }> {
    const ms: number[] = []
    const points: number[] = []
    for (let i = 0; i < frames; ++i) {
      await new Promise((resume) => setTimeout(resume))
      if (budget) this.budget = budget
      this.scheduled = true // nothing else draws meanwhile
      const begin = performance.now()
      this.orbit(0.03, 0)
      this.frame()
      this.drawOverlayNow()
      this.painter.finish()
      ms.push(performance.now() - begin)
      points.push(this.frameTimes.at(-1)!.points)
    }
    this.scheduled = false
    this.moved()
    return { ms, points }
  }
}

export const viewerHelp = make(
  'ul',
  {},
  ...[
    ['drag', 'turn'],
    ['right drag, two fingers', 'move'],
    ['wheel (after a click), pinch', 'zoom'],
    ['arrow keys', 'turn; with Shift: move'],
    ['+ \u2212', 'zoom'],
    ['N, P', 'next, previous loop'],
    ['Home', 'all of the map'],
  ].map(([key, what]) => make('li', {}, make('kbd', {}, key), ` ${what}`)),
)
