// What draws the points: WebGL where it is, a plain canvas where it is not.
import type { PerspectiveCamera } from 'three'
import type { CloudNode } from './cloud'
import type { ColorMode } from './colors'

export interface Coloring {
  mode: ColorMode
  low: number // of the colour scale: m, scans' numbers in the cloud, m
  high: number
  undo: number // 0: loops closed, 1: as if none were
  pointScale: number
  highlight?: [number, number] // scans' numbers in the cloud
}

export interface Painter {
  readonly kind: 'webgl' | 'canvas'
  readonly canvas: HTMLCanvasElement
  readonly leastPointsAFrame: number
  readonly firstPointsAFrame: number
  readonly mostPointsAFrame: number
  addNode(node: CloudNode): void
  resize(width: number, height: number, pixelRatio: number): void
  /** Adds to what is there unless `clear`. Scene coordinates are the map's less its centre. */
  draw(camera: PerspectiveCamera, nodes: CloudNode[], coloring: Coloring, clear: boolean): void
  finish(): void
}
