// Colour scales of the point cloud, and the page's colours for what is drawn on canvases.

export type ColorMode = 'height' | 'time' | 'correction' | 'intensity'
export const colorModes: ColorMode[] = ['height', 'time', 'correction', 'intensity'] // as the shader counts them

// From bluish to warm, all bright enough for the viewer's dark ground, and telling apart without red against green.
const ramps: Record<ColorMode, string[]> = {
  height: ['#4a6fe3', '#2aa7c9', '#4cc38a', '#e8d44d', '#f08a3c'],
  time: ['#6a5be2', '#a95bd6', '#e8648f', '#f8a15c', '#fbe08c'],
  correction: ['#2f6fb5', '#4fb3c4', '#e9e3a6', '#f39c3d', '#e0433f'],
  intensity: ['#39424e', '#6c7886', '#a3adb8', '#d3dae1', '#ffffff'],
}

const channels = (hex: string) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16))

/** 256 RGBA colours. */
export function rampBytes(mode: ColorMode): Uint8Array<ArrayBuffer> {
  const stops = ramps[mode].map(channels)
  const bytes = new Uint8Array(256 * 4)
  for (let i = 0; i < 256; ++i) {
    const place = (i / 255) * (stops.length - 1)
    const stop = Math.min(Math.floor(place), stops.length - 2)
    for (let c = 0; c < 3; ++c)
      bytes[4 * i + c] = Math.round(stops[stop][c] + (place - stop) * (stops[stop + 1][c] - stops[stop][c]))
    bytes[4 * i + 3] = 255
  }
  return bytes
}

export function rampCss(mode: ColorMode): string {
  return `linear-gradient(90deg, ${ramps[mode].join(', ')})`
}

/** A colour of style.css, as it is at the moment. */
export function themeColor(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim()
}
