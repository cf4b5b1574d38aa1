// The point cloud's nodes, as cloud_encoding.h writes them: level by level, each node's points add detail to those above.
import { CloudTable, inflateBlock } from './data'

export interface CloudNode {
  id: number
  level: number
  origin: [number, number, number] // lowest corner, m
  side: number
  step: number // m a unit
  spacing: number // about how far its points are apart, m
  count: number
  /** x, y, z in steps from the origin and the scan's number, point by point. */
  points: Uint16Array<ArrayBuffer>
  /** 0 to 255, of each point; undefined where the map has none. */
  intensity?: Uint8Array<ArrayBuffer>
}

const leastStepsASide = 65535

export function scanOf(table: CloudTable, number: number): number {
  return number * table.scans_a_number
}

function decodeChunk(bytes: Uint8Array, total: number, nodes: CloudNode[]) {
  let at = 0
  for (const node of nodes) {
    const points = node.points
    for (let axis = 0; axis < 4; ++axis) {
      const low = 2 * axis * total + at
      const high = low + total
      let value = 0
      for (let i = 0, to = axis; i < node.count; ++i, to += 4) {
        const coded = bytes[low + i] | (bytes[high + i] << 8)
        value = (value + ((coded >>> 1) ^ -(coded & 1))) & 0xffff
        points[to] = value
      }
    }
    if (node.intensity) node.intensity.set(bytes.subarray(8 * total + at, 8 * total + at + node.count))
    at += node.count
  }
}

/** Unpacks chunk after chunk, leaving the browser time between them. */
export async function loadCloud(table: CloudTable, take: (nodes: CloudNode[], share: number) => void): Promise<void> {
  let row = 0
  let done = 0
  for (let c = 0; c < table.chunks.length; ++c) {
    const [nodeCount, pointCount] = table.chunks[c]
    const bytes = await inflateBlock(`cloud-${c}`)
    const nodes: CloudNode[] = []
    for (let n = 0; n < nodeCount; ++n, ++row) {
      const [level, x, y, z, count] = table.nodes.slice(5 * row, 5 * row + 5)
      const side = table.side_m / 2 ** level
      nodes.push({
        id: row,
        level,
        origin: [table.origin_m[0] + x * side, table.origin_m[1] + y * side, table.origin_m[2] + z * side],
        side,
        step: Math.max(table.step_m, side / leastStepsASide),
        spacing: side / table.cells_a_side,
        count,
        points: new Uint16Array(4 * count),
        intensity: table.has_intensity ? new Uint8Array(count) : undefined,
      })
    }
    decodeChunk(bytes, pointCount, nodes)
    done += pointCount
    take(nodes, done / Math.max(1, table.points_shown))
    await new Promise((resume) => setTimeout(resume))
  }
}
