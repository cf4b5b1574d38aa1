// Points without WebGL, or with one that only pretends: projected one by one into an image, the nearest wins. A WebGL that a
// processor computes (SwiftShader, llvmpipe) takes many times as long for points.
import { Matrix4, PerspectiveCamera, Vector3 } from 'three'
import type { CloudNode } from './cloud'
import { ColorMode, colorModes, rampBytes } from './colors'
import type { Coloring, Painter } from './painter'

export class CanvasPainter implements Painter {
  readonly kind = 'canvas'
  readonly canvas = document.createElement('canvas')
  readonly mostPointsAFrame = 2e6
  readonly leastPointsAFrame = 100e3
  readonly firstPointsAFrame = 250e3
  private readonly context = this.canvas.getContext('2d', { alpha: false, willReadFrequently: true })!
  private readonly ramps = new Map<ColorMode, Uint32Array>()
  private image = this.context.createImageData(1, 1)
  private pixels = new Uint32Array(this.image.data.buffer)
  private depth = new Float32Array(1)

  constructor(
    private readonly center: Vector3,
    private readonly moves: Float32Array,
  ) {
    for (const mode of colorModes)
      this.ramps.set(mode, new Uint32Array(rampBytes(mode).buffer))
  }

  addNode() {}
  finish() {}

  resize(width: number, height: number) {
    this.canvas.width = Math.max(1, Math.round(width))
    this.canvas.height = Math.max(1, Math.round(height))
    this.image = this.context.createImageData(this.canvas.width, this.canvas.height)
    this.pixels = new Uint32Array(this.image.data.buffer)
    this.depth = new Float32Array(this.pixels.length)
  }

  draw(camera: PerspectiveCamera, nodes: CloudNode[], coloring: Coloring, clear: boolean) {
    const { pixels, depth, moves } = this
    const width = this.canvas.width
    const height = this.canvas.height
    if (clear) {
      pixels.fill(0xff17110d)
      depth.fill(Infinity)
    }
    const { mode, highlight } = coloring
    const ramp = this.ramps.get(mode)!
    const scale = 255 / Math.max(coloring.high - coloring.low, 1e-6)
    const m = new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).elements
    const undo = coloring.undo
    const pixelsAMetre = (0.035 * coloring.pointScale * height) / (2 * Math.tan((camera.fov * Math.PI) / 360))
    for (const node of nodes) {
      const [ox, oy, oz] = node.origin
      const { points, step, intensity } = node
      for (let i = 0; i < points.length; i += 4) {
        let x = ox + points[i] * step - this.center.x
        let y = oy + points[i + 1] * step - this.center.y
        let z = oz + points[i + 2] * step - this.center.z
        const scan = points[i + 3]
        const move = 8 * scan
        if (undo > 0) {
          let qx = undo * moves[move]
          let qy = undo * moves[move + 1]
          let qz = undo * moves[move + 2]
          let qw = 1 - undo + undo * moves[move + 3]
          const norm = 1 / Math.hypot(qx, qy, qz, qw)
          qx *= norm
          qy *= norm
          qz *= norm
          qw *= norm
          const cx = qy * z - qz * y + qw * x
          const cy = qz * x - qx * z + qw * y
          const cz = qx * y - qy * x + qw * z
          x += 2 * (qy * cz - qz * cy) + undo * moves[move + 4]
          y += 2 * (qz * cx - qx * cz) + undo * moves[move + 5]
          z += 2 * (qx * cy - qy * cx) + undo * moves[move + 6]
        }
        const w = m[3] * x + m[7] * y + m[11] * z + m[15]
        if (w <= 0.05) continue
        const px = Math.round(((m[0] * x + m[4] * y + m[8] * z + m[12]) / w + 1) * 0.5 * width)
        const py = Math.round((1 - (m[1] * x + m[5] * y + m[9] * z + m[13]) / w) * 0.5 * height)
        const size = Math.min(6, Math.max(1, Math.round(pixelsAMetre / w)))
        if (px < 0 || py < 0 || px + size > width || py + size > height) continue
        const value =
          mode === 'height' ? z + this.center.z
          : mode === 'time' ? scan
          : mode === 'correction' ? moves[move + 7]
          : (intensity?.[i / 4] ?? 0)
        let color = ramp[Math.max(0, Math.min(255, Math.round((value - coloring.low) * scale)))]
        if (highlight !== undefined && (scan < highlight[0] || scan > highlight[1]))
          color = 0xff000000 | ((color >>> 1) & 0x7f7f7f)
        for (let row = py; row < py + size; ++row) {
          for (let at = row * width + px, end = at + size; at < end; ++at) {
            if (w >= depth[at]) continue
            depth[at] = w
            pixels[at] = color
          }
        }
      }
    }
    this.context.putImageData(this.image, 0, 0)
  }
}
