// The scans of the map: where they stand with and without the loops closed, and what was measured of each.
import { Quaternion, Vector3 } from 'three'
import { inflateBlock, Report } from './data'

export interface Pose {
  position: Vector3
  rotation: Quaternion
}

export class Scans {
  readonly count: number
  readonly hasBefore: boolean
  /** How far closing the loops has moved a scan, in m; zeros where that is not known. */
  readonly correction: Float32Array
  readonly largestCorrection: number
  private readonly table = new Map<string, Float32Array>()

  private constructor(report: Report, bytes: Uint8Array) {
    this.count = report.scans
    report.columns.forEach((name, i) =>
      this.table.set(name, new Float32Array(bytes.buffer as ArrayBuffer, 4 * i * this.count, this.count)),
    )
    this.hasBefore = this.table.has('before_x')
    this.correction = new Float32Array(this.count)
    let largest = 0
    if (this.hasBefore) {
      for (let i = 0; i < this.count; ++i) {
        this.correction[i] = this.pose(i).position.distanceTo(this.poseBefore(i).position)
        largest = Math.max(largest, this.correction[i])
      }
    }
    this.largestCorrection = largest
  }

  static async read(report: Report): Promise<Scans> {
    return new Scans(report, await inflateBlock('scans'))
  }

  column(name: string): Float32Array | undefined {
    return this.table.get(name)
  }

  pose(scan: number): Pose {
    return this.poseOf('', scan)
  }
  /** As if no loop had been closed; the same as pose() where that is not known. */
  poseBefore(scan: number): Pose {
    return this.poseOf(this.hasBefore ? 'before_' : '', scan)
  }

  /** The number that people know a scan by. */
  number(scan: number): number {
    return this.column('scan')?.[scan] ?? scan
  }

  private poseOf(prefix: string, scan: number): Pose {
    const value = (name: string) => this.table.get(prefix + name)![scan]
    return {
      position: new Vector3(value('x'), value('y'), value('z')),
      rotation: new Quaternion(value('qx'), value('qy'), value('qz'), value('qw')).normalize(),
    }
  }
}

/** a_from_c of a_from_b and b_from_c. */
export function compose(a: Pose, b: Pose): Pose {
  return {
    position: b.position.clone().applyQuaternion(a.rotation).add(a.position),
    rotation: a.rotation.clone().multiply(b.rotation),
  }
}

export function inverse(a: Pose): Pose {
  const rotation = a.rotation.clone().invert()
  return { position: a.position.clone().negate().applyQuaternion(rotation), rotation }
}
