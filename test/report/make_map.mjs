// A small map folder, made of numbers: two rounds about a house, a drift that two loops have taken out, one loop refused.
import { mkdirSync, writeFileSync } from 'node:fs'
import { join } from 'node:path'

const scansARound = 30
const scans = 2 * scansARound
const pointsAScan = 1500

// Mulberry32, so that the map is the same every time.
let state = 12345
function random() {
  state = (state + 0x6d2b79f5) | 0
  let t = Math.imul(state ^ (state >>> 15), 1 | state)
  t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t
  return ((t ^ (t >>> 14)) >>> 0) / 4294967296
}

const place = (scan) => {
  const angle = (2 * Math.PI * scan) / scansARound
  return { x: 24 * Math.sin(angle), y: 24 * (1 - Math.cos(angle)), heading: angle }
}
const tum = (scan, drift) => {
  const { x, y, heading } = place(scan)
  const bent = heading + 0.05 * drift
  return `${(100 + 1.2 * scan).toFixed(3)} ${x + 3 * drift} ${y - 1.5 * drift} ${0.4 * drift} 0 0 ${Math.sin(bent / 2)} ${Math.cos(bent / 2)}\n`
}
const loop = (first, last, accepted, reason, more) => ({
  first, last, first_scan: first + 1, last_scan: last + 1, accepted, reason,
  distance_m: 2.1, overlap: 0.7, rms_m: 0.03, mahalanobis2: 4, correction_m: 2.2, correction_deg: 2.9, iterations: 9,
  first_from_last_before: [2, -1, 0.2, 0, 0, 0.025, 0.99969], ...more,
})

export function makeMap(folder) {
  mkdirSync(folder, { recursive: true })
  const rows = Array.from({ length: scans }, (_, i) => i)
  writeFileSync(join(folder, 'trajectory.tum'), rows.map((i) => tum(i, 0)).join(''))
  writeFileSync(join(folder, 'trajectory_without_loops.tum'), rows.map((i) => tum(i, i / scans)).join(''))
  writeFileSync(
    join(folder, 'scans.csv'),
    'scan,stamp_s,points,iterations,correspondences,overlap,rms_m,is_predicted,step,doubt,fit,surfaces,held_x,held_y,held_z,held_roll,held_pitch,held_yaw,reduce_ms,store_ms,match_ms,detect_ms,loop_match_ms,loop_share_out_ms\n' +
      rows.map((i) => `${i + 1},${(100 + 1.2 * i).toFixed(3)},${pointsAScan},${5 + (i % 4)},900,0.9,${0.01 + 0.001 * (i % 7)},0,${i === 0 ? 'first' : 'believed'},none,0.8,1300,${0.02 + 0.001 * (i % 9)},0.2,0.4,0.3,0.2,0.1,1.5,9,${3 + (i % 5)},0.01,${i % 20 === 19 ? 12 : 0},${i % 20 === 19 ? 0.2 : 0}`).join('\n') + '\n',
  )
  const run = {
    program: { name: 'alces', version: '0', command_line: ['alces', 'replay', '</script><b>drive</b>.mcap'] },
    source: { description: 'a drive made of numbers', scans },
    front_end: 'default', complete: true, stopped_by: null, scans, length_m: 301,
    verdict: 'doubtful', health: { doubt: 'scans <b>do not fit</b>', parts: 1, weakest_scans: [17, 4, 999] },
    settings: { belief: { minimum_overlap: 0.4, maximum_rms_m: 0.1, maximum_mahalanobis2: 30 }, loop_match: { scans_around_first: 2, scans_before_last: 2 } },
    loops: [
      loop(1, 31, true, 'closed', {}),
      loop(5, 36, false, 'refused: too little overlap', { overlap: 0.22, mahalanobis2: 0 }),
      loop(12, 42, true, 'closed', { correction_m: 0.4 }),
    ],
    times: {
      front_end: { median_ms: 14, worst_ms: 30, total_s: 0.9 }, reduce: { median_ms: 1.5, worst_ms: 2, total_s: 0.1 },
      store: { median_ms: 9, worst_ms: 12, total_s: 0.55 }, match: { median_ms: 4, worst_ms: 9, total_s: 0.25 },
      detect: { median_ms: 0.01, worst_ms: 0.02, total_s: 0.001 }, loop_match: { median_ms: 12, worst_ms: 12, total_s: 0.04 },
      loop_share_out: { median_ms: 0.2, worst_ms: 0.2, total_s: 0.001 }, mapping_s: 0.95, read_wait_s: 0.1, run_s: 1.1, write_s: { 'map.ply': 0.02 },
    },
    memory: { limit_bytes: 1 << 26, block_bytes: 1 << 26, pool_bytes: 50 << 20, pool_used_bytes: 9 << 20, scans_bytes: 90000, cache_bytes: 7 << 20, working_bytes: 6 << 20, archive_bytes: 0, process_peak_bytes: 80 << 20 },
    optimize: { with: 'lum', iterations: 12, seconds: 15.1, complete: true },
    counters: { points_in: 120000, points_stored: scans * pointsAScan, loops_closed: 2 },
    refused_scans: [], warnings: ['gps: no usable fix comes, 3 times (first at 20.0 s)'],
    drive: {
      begin_s: 96, duration_s: 80, events: 94000, deskew: true, scans: { handed_on: scans },
      counters: { gps: { fixes: 40, jumps: 0 }, motor: { heartbeats: 700, emcys: 1 } },
      notices: [
        { source: 'gps', text: 'no usable fix comes', severity: 'warning', times: 3, first_s: 20, last_s: 61, at_s: [20, 44, 61] },
        { source: 'motor', text: 'emergency <img src=x onerror=alert(1)>', severity: 'error', times: 1, first_s: 33, last_s: 33, at_s: [33] },
        { source: 'motor', text: 'at speed', severity: 'info', times: 1, first_s: 2, last_s: 2, at_s: [2] },
      ],
    },
  }
  writeFileSync(join(folder, 'run.json'), JSON.stringify(run))
  const samples = Array.from({ length: 81 }, (_, i) => i)
  writeFileSync(
    join(folder, 'counters.csv'),
    'time_s,gps.fixes,motor.heartbeats,motor.emcys\n' + samples.map((s) => `${s}.000,${Math.floor(s / 2)},${9 * s},${s > 33 ? 1 : 0}`).join('\n') + '\n',
  )
  // The house's walls, the ground and a fence, as each scan sees them.
  const bytes = Buffer.alloc(17 * scans * pointsAScan)
  let at = 0
  for (const scan of rows) {
    const here = place(scan)
    for (let i = 0; i < pointsAScan; ++i) {
      const kind = random()
      let x = here.x + 30 * (random() - 0.5)
      let y = here.y + 30 * (random() - 0.5)
      let z = 0
      if (kind < 0.45) {
        const side = Math.floor(4 * random())
        const along = 20 * (random() - 0.5)
        x = side < 2 ? along : side === 2 ? -10 : 10
        y = 24 + (side < 2 ? (side === 0 ? -10 : 10) : along)
        z = 6 * random()
      } else if (kind < 0.6) {
        const angle = 2 * Math.PI * random()
        x = 36 * Math.sin(angle)
        y = 24 - 36 * Math.cos(angle)
        z = 1.5 * random()
      }
      for (const value of [x, y, z - 0.8]) at = bytes.writeFloatLE(value + 0.01 * (random() - 0.5), at)
      at = bytes.writeUInt32LE(scan + 1, at)
      at = bytes.writeUInt8(kind < 0.45 ? 160 + 15 * Math.floor(z) : 30, at) // walls are brighter, the higher the more
    }
  }
  const header =
    `ply\nformat binary_little_endian 1.0\nelement vertex ${scans * pointsAScan}\n` +
    'property float x\nproperty float y\nproperty float z\nproperty uint scan\nproperty uchar intensity\nend_header\n'
  writeFileSync(join(folder, 'map.ply'), Buffer.concat([Buffer.from(header), bytes]))
  return { scans, points: scans * pointsAScan, loops: run.loops.length }
}
