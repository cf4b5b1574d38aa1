// Points by WebGL 2 (three.js): every node a buffer of four 16-bit numbers a point, all else in the shader.
import {
  BufferAttribute,
  BufferGeometry,
  DataTexture,
  FloatType,
  GLSL3,
  LinearFilter,
  NearestFilter,
  PerspectiveCamera,
  Points,
  RawShaderMaterial,
  RGBAFormat,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from 'three'
import type { CloudNode } from './cloud'
import { ColorMode, colorModes, rampBytes } from './colors'
import type { Coloring, Painter } from './painter'

const textureWidth = 2048 // texels; two a scan

const vertexShader = `
precision highp float;
precision highp int;
precision highp sampler2D;
uniform mat4 modelMatrix, viewMatrix, projectionMatrix;
uniform sampler2D scans;  // rotation of map_before_from_map; its translation and the correction
uniform sampler2D ramp;
uniform int mode;
uniform vec2 range;
uniform float undo;  // 0: loops closed, 1: as if none were
uniform float pixelsAMetre;  // at a metre's distance
uniform vec2 size;  // of a point: metres, least pixels
uniform vec2 highlight;  // first and last scan shown brighter, or -1
in vec4 position;
in float intensity;
out vec3 color;
void main() {
  int scan = int(position.w + 0.5);
  ivec2 texel = ivec2((2 * scan) % ${textureWidth}, (2 * scan) / ${textureWidth});
  vec4 turn = texelFetch(scans, texel, 0);
  vec4 shift = texelFetch(scans, texel + ivec2(1, 0), 0);
  vec4 place = modelMatrix * vec4(position.xyz, 1.0);
  if (undo > 0.0) {
    vec4 q = normalize(mix(vec4(0, 0, 0, 1), turn, undo));
    place.xyz += 2.0 * cross(q.xyz, cross(q.xyz, place.xyz) + q.w * place.xyz) + undo * shift.xyz;
  }
  vec4 seen = viewMatrix * place;
  gl_Position = projectionMatrix * seen;
  gl_PointSize = clamp(size.x * pixelsAMetre / -seen.z, size.y, 12.0 * size.y);
  float value = mode == 0 ? place.z : mode == 1 ? position.w : mode == 2 ? shift.w : intensity;
  color = texture(ramp, vec2(clamp((value - range.x) / (range.y - range.x), 0.0, 1.0) * 0.996 + 0.002, 0.5)).rgb;
  if (highlight.x >= 0.0) {
    bool is_in = position.w >= highlight.x - 0.5 && position.w <= highlight.y + 0.5;
    color = is_in ? vec3(1.0) : 0.55 * color;
  }
}`

const fragmentShader = `
precision highp float;
in vec3 color;
out vec4 pixel;
void main() { pixel = vec4(color, 1.0); }`

/** No graphics processor behind it. */
function isComputed(context: WebGL2RenderingContext): boolean {
  const names = context.getExtension('WEBGL_debug_renderer_info')
  const renderer = String(context.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : context.RENDERER))
  return /swiftshader|llvmpipe|softpipe|basic render|software/i.test(renderer)
}

export class WebGlPainter implements Painter {
  readonly kind = 'webgl'
  readonly canvas: HTMLCanvasElement
  readonly mostPointsAFrame = 12e6
  readonly leastPointsAFrame = 200e3
  readonly firstPointsAFrame = 1e6
  private readonly renderer: WebGLRenderer
  private readonly scene = new Scene()
  private readonly material: RawShaderMaterial
  private readonly objects = new Map<number, Points>()
  private readonly ramps = new Map<ColorMode, DataTexture>()
  private shown: Points[] = []

  /** Throws where there is no WebGL 2; also where it is only computed, unless `inSoftwareToo`. */
  constructor(
    private readonly center: Vector3,
    moves: Float32Array, // 8 numbers a scan: rotation, translation and correction of the map before
    inSoftwareToo: boolean,
  ) {
    this.canvas = document.createElement('canvas')
    const context = this.canvas.getContext('webgl2', {
      antialias: false,
      alpha: false,
      preserveDrawingBuffer: true, // detail is added to what is there
      powerPreference: 'high-performance',
    })
    if (!context) throw new Error('no WebGL 2')
    if (!inSoftwareToo && isComputed(context)) throw new Error('WebGL in software only')
    this.renderer = new WebGLRenderer({ canvas: this.canvas, context })
    this.renderer.autoClear = false
    this.renderer.setClearColor(0x0d1117)
    const rows = Math.max(1, Math.ceil(moves.length / 4 / textureWidth))
    const texels = new Float32Array(4 * textureWidth * rows)
    texels.set(moves)
    const scans = new DataTexture(texels, textureWidth, rows, RGBAFormat, FloatType)
    scans.minFilter = scans.magFilter = NearestFilter
    scans.needsUpdate = true
    for (const mode of colorModes) {
      const texture = new DataTexture(rampBytes(mode), 256, 1, RGBAFormat)
      texture.minFilter = texture.magFilter = LinearFilter
      texture.needsUpdate = true
      this.ramps.set(mode, texture)
    }
    this.material = new RawShaderMaterial({
      glslVersion: GLSL3,
      vertexShader,
      fragmentShader,
      uniforms: {
        scans: { value: scans },
        ramp: { value: null },
        mode: { value: 0 },
        range: { value: new Vector2(0, 1) },
        undo: { value: 0 },
        pixelsAMetre: { value: 1 },
        size: { value: new Vector2(0.04, 1.5) },
        highlight: { value: new Vector2(-1, -1) },
      },
    })
    this.scene.matrixWorldAutoUpdate = false
  }

  addNode(node: CloudNode) {
    const geometry = new BufferGeometry()
    geometry.setAttribute('position', new BufferAttribute(node.points, 4))
    if (node.intensity) geometry.setAttribute('intensity', new BufferAttribute(node.intensity, 1))
    const points = new Points(geometry, this.material)
    points.frustumCulled = false // the viewer has chosen
    points.visible = false
    points.matrixAutoUpdate = false
    points.matrix.makeScale(node.step, node.step, node.step)
    points.matrix.setPosition(
      node.origin[0] - this.center.x,
      node.origin[1] - this.center.y,
      node.origin[2] - this.center.z,
    )
    points.matrixWorld.copy(points.matrix)
    this.objects.set(node.id, points)
    this.scene.add(points)
  }

  resize(width: number, height: number, pixelRatio: number) {
    this.renderer.setPixelRatio(pixelRatio)
    this.renderer.setSize(width, height, false)
  }

  draw(camera: PerspectiveCamera, nodes: CloudNode[], coloring: Coloring, clear: boolean) {
    const uniforms = this.material.uniforms
    const mode = coloring.mode
    uniforms.ramp.value = this.ramps.get(mode)
    uniforms.mode.value = colorModes.indexOf(mode)
    uniforms.range.value.set(coloring.low, Math.max(coloring.high, coloring.low + 1e-6))
    if (mode === 'height') uniforms.range.value.addScalar(-this.center.z)
    uniforms.undo.value = coloring.undo
    uniforms.highlight.value.set(coloring.highlight?.[0] ?? -1, coloring.highlight?.[1] ?? -1)
    const ratio = this.renderer.getPixelRatio()
    uniforms.size.value.set(0.035 * coloring.pointScale, 1.35 * ratio * coloring.pointScale)
    uniforms.pixelsAMetre.value = this.canvas.height / (2 * Math.tan((camera.fov * Math.PI) / 360))
    for (const points of this.shown) points.visible = false
    this.shown = nodes.map((node) => this.objects.get(node.id)!)
    for (const points of this.shown) points.visible = true
    if (clear) this.renderer.clear()
    this.renderer.render(this.scene, camera)
  }

  /** Waits for the graphics processor: only for measuring. */
  finish() {
    const context = this.renderer.getContext()
    context.readPixels(0, 0, 1, 1, context.RGBA, context.UNSIGNED_BYTE, new Uint8Array(4))
  }
}
