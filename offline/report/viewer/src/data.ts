// What the program has put into the page: one JSON element, and numbers as deflated bytes in base64.

export interface Loop {
  first: number // rows of the trajectory
  last: number
  first_scan?: number // numbers of the files
  last_scan?: number
  accepted: boolean
  reason?: string
  distance_m?: number
  overlap?: number
  rms_m?: number
  mahalanobis2?: number
  correction_m?: number
  correction_deg?: number
  iterations?: number
  first_from_last_before?: number[] // x y z qx qy qz qw
}

export interface Notice {
  source: string
  text: string
  severity: string
  times: number
  first_s: number
  last_s: number
  at_s?: number[]
}

type Stage = { median_ms: number; worst_ms: number; total_s: number }

export interface Run {
  program?: { name?: string; version?: string; command_line?: string[] }
  source?: { description?: string; scans?: number }
  front_end?: string
  complete?: boolean
  stopped_by?: string | null
  scans?: number
  length_m?: number
  verdict?: string // good, doubtful, bad
  health?: { doubt?: string; parts?: number; weakest_scans?: number[] } & Record<string, unknown>
  loops: Loop[]
  settings?: Record<string, any>
  points_a_scan?: { median: number; max: number }
  times?: Record<string, any> & { front_end?: Stage }
  memory?: Record<string, number>
  counters?: Record<string, number>
  refused_scans?: { scan: number; name: string; reason: string }[]
  warnings?: string[]
  /** Of a map that alces optimize made better; all else but the poses is as it was. */
  optimize?: { with?: string; iterations?: number; seconds?: number; complete?: boolean }
  drive?: {
    begin_s?: number
    duration_s?: number
    events?: number
    deskew?: boolean
    scans?: Record<string, number>
    counters?: Record<string, Record<string, number>>
    notices?: Notice[]
  }
}

export interface CloudTable {
  origin_m: [number, number, number]
  side_m: number
  step_m: number
  cells_a_side: number
  scans_a_number: number
  has_intensity: boolean
  points: number
  points_shown: number
  points_left_out: number
  nodes: number[] // level, x, y, z, points
  chunks: [number, number][] // nodes, points
}

export interface Report {
  title: string
  scans: number
  has_time: boolean
  first_stamp_s?: number // of the vehicle's clock
  columns: string[]
  run: Run
  cloud: CloudTable
  counters?: { names: string[]; time_s: number[]; values: number[][] }
  comparison?: {
    name: string
    tables: { name: string; columns: string[]; rows: string[][] }[]
    pictures: { name: string; href: string }[]
  }
}

export function readReport(): Report {
  return JSON.parse(document.getElementById('report')!.textContent!) as Report
}

function fromBase64(text: string): Uint8Array<ArrayBuffer> {
  const native = (Uint8Array as { fromBase64?: (text: string) => Uint8Array<ArrayBuffer> }).fromBase64
  if (native) return native.call(Uint8Array, text)
  const binary = atob(text)
  const bytes = new Uint8Array(binary.length)
  for (let i = 0; i < binary.length; ++i) bytes[i] = binary.charCodeAt(i)
  return bytes
}

/** The bytes of a block; its element is emptied, since nobody needs the text again. */
export async function inflateBlock(id: string): Promise<Uint8Array<ArrayBuffer>> {
  const element = document.getElementById(id)!
  const packed = fromBase64(element.textContent!)
  element.textContent = ''
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'))
  return new Uint8Array(await new Response(stream).arrayBuffer())
}
