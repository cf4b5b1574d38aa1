// Chromium without a display, a network and an accelerator.
import { createRequire } from 'node:module'
import { mkdtempSync } from 'node:fs'
import { tmpdir } from 'node:os'
import { join } from 'node:path'

/** A fresh browser; `work` has node_modules with playwright-core. */
export async function openBrowser(work, options = {}) {
  const { chromium } = createRequire(join(work, 'package.json'))('playwright-core')
  const profile = mkdtempSync(join(tmpdir(), 'alces_report_'))
  const context = await chromium.launchPersistentContext(profile, {
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    headless: true,
    args: [
      '--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist', '--disable-quic',
      '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync',
    ],
    ...options,
  })
  return { context, profile }
}

/** What a page must not do: ask for anything but itself, complain. */
export function watch(page) {
  const complaints = []
  page.on('request', (request) => {
    if (!/^(file|data|blob):/.test(request.url())) complaints.push(`asks for ${request.url()}`)
  })
  page.on('console', (message) => {
    const noise = /GPU stall due to ReadPixels|Automatic fallback to software WebGL/.test(message.text())
    if (['error', 'warning'].includes(message.type()) && !noise) complaints.push(`console: ${message.text()}`)
  })
  page.on('pageerror', (error) => complaints.push(`error: ${error.message}`))
  page.on('dialog', (dialog) => complaints.push(`dialog: ${dialog.message()}`))
  return complaints
}
