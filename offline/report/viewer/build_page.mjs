// node build_page.mjs SOURCE WORK PAGE: src/page.html with the program and the style put into it.
import { readFile, writeFile } from 'node:fs/promises'
import { createRequire } from 'node:module'
import { join } from 'node:path'

const [source, work, page] = process.argv.slice(2)
const { build } = createRequire(join(work, 'package.json'))('esbuild')

const result = await build({
  entryPoints: [join(source, 'src/main.ts')],
  nodePaths: [join(work, 'node_modules')],
  bundle: true,
  minify: true,
  write: false,
  outdir: 'out',
  format: 'iife',
  target: ['chrome103', 'firefox113', 'safari16.4'], // the first with DecompressionStream
  legalComments: 'inline', // the libraries' licences ask for it
})
const text = (ending) => result.outputFiles.find((file) => file.path.endsWith(ending)).text

const parts = {
  '/*alces:style*/': text('.css').replaceAll('</style', '<\\/style'),
  '/*alces:program*/': text('.js').replaceAll('</script', '<\\/script').replaceAll('<!--', '<\\!--'),
}
let html = await readFile(join(source, 'src/page.html'), 'utf8')
for (const [mark, content] of Object.entries(parts)) {
  if (!html.includes(mark)) throw new Error(`page.html has no ${mark}`)
  html = html.replace(mark, () => content)
}
await writeFile(page, html)
